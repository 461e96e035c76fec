// Faces of low things end at their tops, not where their outlines do.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/grid/rasterizer.hpp>

#include "grid/terrain.hpp"

namespace lamina {
namespace {

// Floor from x = -1 to 1, and from there on at `rise`, to x = 2; `face` between the two, seen from
// below the rise, its outline a tenth of a metre too high and too low.
PlanarMap step_up(double rise, double face) {
  PlanarMap map;
  test::add_path(map, {-0.8, 0, 0}, {0.5, 0, 0});
  test::add_floor(map, {-1, -1}, {2, 1}, [&](double x, double) { return x < 1 ? 0.0 : rise; });
  test::add_wall(map, {1, 1}, {1, -1}, -0.09, face + 0.09);
  EXPECT_LT(map.planes.front().plane_map.normal().x(), 0);
  return map;
}

float highest_at_face(const NavigabilityGrid& grid) {
  float most = -1;
  for (double x = 0.825; x < 1.2; x += 0.05) most = std::max(most, test::at(grid, x, 0.025).height);
  return most;
}

TEST(RasterFaces, AStepIsAsHighAsItsTop) {
  for (const double rise : {0.03, 0.05, 0.1, 0.2}) {
    const NavigabilityGrid grid = rasterize(step_up(rise, rise));
    EXPECT_NEAR(highest_at_face(grid), rise, 1e-5) << rise;
    EXPECT_EQ(test::at(grid, 0.975, 0.025).navigability, 0.0F) << rise;
  }
}

// A robot climbs 2 cm: such a face bars nothing.
TEST(RasterFaces, AStepOfTIsDriven) {
  const NavigabilityGrid grid = rasterize(step_up(0.02, 0.02));
  for (double x = 0.825; x < 1.2; x += 0.05) {
    EXPECT_GT(test::at(grid, x, 0.025).navigability, 0.9F) << x;
  }
}

// A board, with the same floor before and behind it: nothing tells its height but its outline.
TEST(RasterFaces, ABoardKeepsItsHeight) {
  for (const double height : {0.03, 0.06, 0.1}) {
    const NavigabilityGrid grid = rasterize(step_up(0, height));
    EXPECT_GE(highest_at_face(grid), height) << height;
    EXPECT_EQ(test::at(grid, 0.975, 0.025).navigability, 0.0F) << height;
  }
}

// What lies before a step's face is floor up to it: the row of cells beside the face's is not
// blocked.
TEST(RasterFaces, AStepTakesNoneOfTheFloorBeforeIt) {
  for (const double at : {-0.01, 0.0, 0.01}) {  // where the face is measured
    PlanarMap map;
    test::add_path(map, {-0.8, 0, 0}, {0.5, 0, 0});
    test::add_floor(map, {-1, -1}, {2, 1}, [&](double x, double) { return x < 1 ? 0.0 : 0.1; });
    test::add_wall(map, {1 + at, 1}, {1 + at, -1}, -0.09, 0.19);
    const NavigabilityGrid grid = rasterize(map);
    EXPECT_EQ(test::at(grid, 0.975, 0.025).navigability, 0.0F) << at;
    EXPECT_FALSE(test::at(grid, 0.925, 0.025).navigability == 0.0F) << at;
    EXPECT_NEAR(highest_at_face(grid), 0.1, 1e-5) << at;
  }
}

TEST(RasterFaces, AWallOnAPlatformStays) {
  const NavigabilityGrid grid = rasterize(step_up(0.05, 0.4));
  EXPECT_GE(highest_at_face(grid), 0.4F);
}

// The side that it was seen from is the low one: a drop seen from above has no face.
TEST(RasterFaces, SeenFromBehindNothingIsCut) {
  PlanarMap map = step_up(0.05, 0.05);
  map.planes.front().plane_map = Plane(Eigen::Vector3d(1, 0, 0), 1);
  EXPECT_GE(highest_at_face(rasterize(map)), 0.1F);
}

}  // namespace
}  // namespace lamina
