// Beams that end on ramps.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/grid/evidence/ground_surfaces.hpp>

namespace lamina {
namespace {

MapPlane patch(PlaneLabel label, const Plane& plane, double x0, double x1) {
  MapPlane result;
  result.label = label;
  result.plane_map = plane;
  auto& outline = result.outlines_map.emplace_back();
  for (const auto& [x, y] : {std::pair{x0, -1.0}, {x1, -1.0}, {x1, 1.0}, {x0, 1.0}}) {
    const double z = (plane.rho() - plane.normal().x() * x) / plane.normal().z();
    outline.emplace_back(x, y, z);
  }
  result.centroid_map = (outline[0] + outline[2]) / 2;
  return result;
}

const Plane kFloor({0, 0, 1}, 0);
// Rises from x = 2 by 1 in 10.
const Plane kRamp = *Plane::from_normal_rho({-0.1, 0, 1}, -0.2);

const Eigen::Vector3d kScanner(0, 0, 0.25);

TEST(GroundHits, HoldsPointsOnRampsAndTheFloorBefore) {
  const GroundHits ground({patch(PlaneLabel::kFloor, kFloor, -3, 2),
                           patch(PlaneLabel::kRamp, kRamp, 2, 6),
                           patch(PlaneLabel::kWall, Plane({-1, 0, 0}, -6), 6, 6)});
  EXPECT_FALSE(ground.empty());
  EXPECT_TRUE(ground.ends_on(kScanner, {4.5, 0, 0.25}, 0.05));
  EXPECT_TRUE(ground.ends_on(kScanner, {0, 0.5, 0.02}, 0.05));
  EXPECT_FALSE(ground.ends_on(kScanner, {4.5, 0, 0.35}, 0.05));  // 10 cm over it
  EXPECT_FALSE(ground.ends_on(kScanner, {4.5, 2, 0.25}, 0.05));  // beside it
}

TEST(GroundHits, ABeamAlongTheTopOfAPalletEndsAtTheWallBehind) {
  const GroundHits ground({patch(PlaneLabel::kStep, Plane({0, 0, 1}, 0.22), 1, 2),
                           patch(PlaneLabel::kRamp, kRamp, 2, 6)});
  EXPECT_FALSE(ground.ends_on(kScanner, {1.99, 0, 0.25}, 0.05));
  EXPECT_TRUE(ground.ends_on({0, 0, 0.4}, {1.99, 0, 0.25}, 0.05));  // from higher up
}

TEST(GroundHits, KnowsWhatIsUnderABodyOrAPoint) {
  const GroundHits ground({patch(PlaneLabel::kFloor, kFloor, -3, 2),
                           patch(PlaneLabel::kRamp, kRamp, 2, 6),
                           patch(PlaneLabel::kFloor, Plane({0, 0, 1}, 3), -3, 2)});
  EXPECT_NEAR(*ground.under({0, 0, 0.6}), 0, 1e-12);
  EXPECT_NEAR(*ground.under({0, 0, 2.98}), 3, 1e-12);  // another storey
  EXPECT_NEAR(*ground.under({4, 0, 0.5}), 0.2, 1e-12);
  EXPECT_FALSE(ground.under({8, 0, 0.5}));
  EXPECT_FALSE(ground.under({4, 0, 0}));  // under the ramp
}

TEST(GroundHits, TheNearestGroundIsTheOneMeant) {
  const GroundHits ground({patch(PlaneLabel::kFloor, kFloor, -3, 2),
                           patch(PlaneLabel::kStep, Plane({0, 0, 1}, 0.03), -1, 1)},
                          GroundHits::Of::kAnyMap);
  EXPECT_NEAR(*ground.nearest({0, 0, 0.005}, 0.015), 0, 1e-12);
  EXPECT_NEAR(*ground.nearest({0, 0, 0.025}, 0.015), 0.03, 1e-12);
  EXPECT_FALSE(ground.nearest({0, 0, 0.05}, 0.015));
  EXPECT_FALSE(ground.nearest({5, 0, 0}, 0.015));
}

TEST(GroundHits, WithoutARampThereIsNone) {
  EXPECT_TRUE(GroundHits({patch(PlaneLabel::kFloor, kFloor, -3, 2)}).empty());
}

}  // namespace
}  // namespace lamina
