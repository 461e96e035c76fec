// A wall of many sightings, and what few saw in its place.
#include <gtest/gtest.h>

#include <lamina/backend/consistency/leaning_walls.hpp>

namespace lamina {
namespace {

// Seen from the origin, `x` m ahead at 1 m of height, 2 m high; it leans by `lean` (m per m).
MapPlane wall(double x, double lean, double y0, double y1, std::int64_t observations) {
  MapPlane plane;
  const Eigen::Vector3d normal = Eigen::Vector3d(-1, 0, lean).normalized();
  plane.plane_map = Plane(normal, normal.dot(Eigen::Vector3d(x, 0, 1)));
  plane.observations = observations;
  plane.area = 2 * (y1 - y0);
  auto& outline = plane.outlines_map.emplace_back();
  for (int k = 0; k <= 20; ++k) outline.emplace_back(x + lean * (0.1 * k - 1), y0, 0.1 * k);
  for (int k = 20; k >= 0; --k) outline.emplace_back(x + lean * (0.1 * k - 1), y1, 0.1 * k);
  return plane;
}

std::size_t left_out(const MapPlane& other, std::int64_t observations = 100) {
  std::vector<MapPlane> planes = {other, wall(5, 0, -3, 3, observations)};
  const std::size_t out = leave_out_leaning(planes);
  EXPECT_EQ(planes.size() + out, 2U);
  EXPECT_EQ(planes.back().observations, observations);
  return out;
}

TEST(LeaningWalls, AFewImagesWallThatGoesThroughAnotherIsLeftOut) {
  EXPECT_EQ(left_out(wall(5, 0.2, -2, 2, 5)), 1U);
  EXPECT_EQ(left_out(wall(5.05, -0.2, -2, 2, 5)), 1U);
}

TEST(LeaningWalls, OneThatAsManySawStays) { EXPECT_EQ(left_out(wall(5, 0.2, -2, 2, 30)), 0U); }

TEST(LeaningWalls, WhatStandsBeforeItOrInANicheStays) {
  EXPECT_EQ(left_out(wall(4.7, 0.1, -2, 2, 5)), 0U);
  EXPECT_EQ(left_out(wall(5.3, 0, -2, 2, 5)), 0U);
}

TEST(LeaningWalls, WhatTurnsAwayLiesBesideOrIsSmallStays) {
  EXPECT_EQ(left_out(wall(5, 0.5, -2, 2, 5)), 0U);  // 27 degrees
  EXPECT_EQ(left_out(wall(5, 0.2, 4, 7, 5)), 0U);
  EXPECT_EQ(left_out(wall(5, 0.2, 0, 0.4, 5)), 0U);  // 0.8 m^2
}

// Walls stand plumb: of two that cross, that do, nothing tells which is right.
TEST(LeaningWalls, OneThatStandsPlumbStays) {
  MapPlane turned = wall(5, 0, -2, 2, 5);
  const Eigen::Vector3d normal = Eigen::Vector3d(-1, 0.2, 0).normalized();
  turned.plane_map = Plane(normal, normal.dot(Eigen::Vector3d(5, 0, 1)));
  for (auto& p : turned.outlines_map[0]) p.x() = 5 + 0.2 * p.y();
  EXPECT_EQ(left_out(turned), 0U);
}

TEST(LeaningWalls, FloorsAreNotAsked) {
  std::vector<MapPlane> planes = {wall(5, 0, -3, 3, 100)};
  MapPlane& floor = planes.emplace_back(wall(5, 0, -3, 3, 2));
  floor.plane_map = Plane({0, 0, 1}, 0);
  EXPECT_EQ(leave_out_leaning(planes), 0U);
}

}  // namespace
}  // namespace lamina
