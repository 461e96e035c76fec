// How far apart pieces of one surface may lie.
#include <lamina/backend/association/outline_gap.hpp>

#include <gtest/gtest.h>

#include <lamina/backend/association/outlines.hpp>

namespace lamina {
namespace {

// A piece of the wall y = 0 from `from` to `to` (m along x), a metre high.
std::vector<Eigen::Vector3d> piece(double from, double to) {
  std::vector<Eigen::Vector3d> points;
  for (double x = from; x < to + 0.01; x += 0.1) {
    for (double z = 0; z < 1.01; z += 0.1) points.emplace_back(x, 0, z);
  }
  return points;
}

TEST(PieceGap, ADoorInterruptsAWallAndTwoDesksAreTwo) {
  constexpr double kMost = 1.5;
  EXPECT_TRUE(beside(piece(0, 3), piece(4, 6), kMost));       // a door
  EXPECT_TRUE(beside(piece(4, 6), piece(0, 3), kMost));       // whichever comes first
  EXPECT_FALSE(beside(piece(0, 0.5), piece(1.5, 2), kMost));  // two pillars
  EXPECT_FALSE(beside(piece(0, 3), piece(4, 4.5), kMost));    // a wall, and a pillar beyond a door
  EXPECT_TRUE(beside(piece(0, 0.2), piece(0.6, 0.8), kMost));
  EXPECT_FALSE(beside(piece(0, 9), piece(10.6, 19), kMost));  // wider than any door
  EXPECT_FALSE(beside({}, piece(0, 1), kMost));
}

TEST(PieceGap, AStrokeTellsNothingOfHeights) {
  std::vector<Eigen::Vector3d> high, stroke;
  for (const Eigen::Vector3d& p : piece(0, 3)) high.push_back(p + Eigen::Vector3d(0, 0, 0.9));
  for (double x = 3.4; x < 3.8; x += 0.1) stroke.emplace_back(x, 0, 0.3);
  EXPECT_TRUE(beside(high, stroke, 1.5));
  EXPECT_TRUE(beside(stroke, high, 1.5));
  for (auto& p : stroke) p.x() += 0.6;
  EXPECT_TRUE(beside(high, stroke, 1.5));  // a metre off: a short piece of a wall of three
  const std::vector<Eigen::Vector3d> other{{5.2, 0, 0.3}, {5.6, 0, 0.3}};
  EXPECT_FALSE(beside(stroke, other, 1.5));  // two pillars
}

TEST(PieceGap, PointsOfAPlaneAreItsCells) {
  PlaneLandmark plane;
  plane.plane_anchor = Plane({0, 1, 0}, 0);
  plane.T_map_outline = plane_frame(plane.plane_map(), plane.anchor_map);
  plane.outline = OutlineGrid(0.1);
  const std::vector<Eigen::Vector3d> corners{{2, 0, 0}, {3, 0, 0}, {3, 0, 1}, {2, 0, 1}};
  grow_outline(plane, corners);
  const auto seen = seen_points_map(plane);
  EXPECT_EQ(seen.size(), plane.outline.size());
  for (const auto& p : seen) {
    EXPECT_NEAR(p.y(), 0, 1e-12);
    EXPECT_TRUE(p.x() > 1.9 && p.x() < 3.1 && p.z() > -0.1 && p.z() < 1.1) << p.transpose();
  }
  const std::vector<Eigen::Vector3d> before{{2.5, 0.2, 0.5}}, aside{{3.5, 0, 0.5}};
  EXPECT_TRUE(falls_on(plane, before));
  EXPECT_FALSE(falls_on(plane, aside));
}

}  // namespace
}  // namespace lamina
