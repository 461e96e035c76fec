// Strokes of scans that lie on a ramp, and those of walls.
#include <gtest/gtest.h>

#include <lamina/backend/consistency/ground_strokes.hpp>

namespace lamina {
namespace {

constexpr double kScanner = 0.3;  // m over the ground

// A body on level ground before a ramp that rises from x = 2 by 1 in 10.
struct BeforeARamp {
  Graph graph;
  KeyframeId keyframe = graph.add_keyframe(Timestamp::from_seconds(1), SE3());
  PlaneLandmark floor = patch(Plane({0, 0, 1}, 0), {0, 0, 0}, -3, 2);
  PlaneLandmark ramp = patch(*Plane::from_normal_rho({-0.1, 0, 1}, -0.2), {4, 0, 0.2}, 2, 7);

  static PlaneLandmark patch(const Plane& plane, const Eigen::Vector3d& at, double x0, double x1) {
    PlaneLandmark result;
    result.anchor_map = at;
    result.plane_anchor = plane.about(at);
    result.T_map_outline = plane_frame(plane, at);
    std::vector<Eigen::Vector3d> corners;
    for (const auto& [x, y] : {std::pair{x0, -1.0}, {x1, -1.0}, {x1, 1.0}, {x0, 1.0}})
      corners.emplace_back(x, y, (plane.rho() - plane.normal().x() * x) / plane.normal().z());
    grow_outline(result, corners);
    return result;
  }
  bool grounded(double x, double half_width) const {
    const OutlinePiece stroke{keyframe, {{x, -half_width, kScanner}, {x, half_width, kScanner}}};
    return lies_on_ground({stroke}, graph, {&floor, &ramp});
  }
};

TEST(GroundStrokes, WhereARampRisesIntoTheScanIsNoWall) {
  EXPECT_TRUE(BeforeARamp().grounded(5, 0.9));
}

TEST(GroundStrokes, WallsOnGroundStay) {
  const BeforeARamp world;
  EXPECT_FALSE(world.grounded(3, 0.9));   // on the ramp, 20 cm up its face
  EXPECT_FALSE(world.grounded(1, 0.9));   // on the floor, 30 cm up
  EXPECT_FALSE(world.grounded(5, 4));     // as high as the ramp there, but far beyond its sides
  EXPECT_FALSE(world.grounded(-8, 0.9));  // where no ground was seen
}

TEST(GroundStrokes, AWallBehindAPalletAsHighAsTheScannerStays) {
  const BeforeARamp world;
  const PlaneLandmark pallet = BeforeARamp::patch(Plane({0, 0, 1}, 0.28), {1.5, 0, 0.28}, 1, 2);
  const OutlinePiece stroke{world.keyframe, {{1.98, -0.9, kScanner}, {1.98, 0.9, kScanner}}};
  EXPECT_FALSE(lies_on_ground({stroke}, world.graph, {&world.floor, &pallet}));
}

TEST(GroundStrokes, NothingSeenIsNotOnTheGround) {
  const BeforeARamp world;
  EXPECT_FALSE(lies_on_ground({}, world.graph, {&world.floor}));
}

}  // namespace
}  // namespace lamina
