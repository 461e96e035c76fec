// Two lines of one face, and what only lies near a face.
#include <lamina/backend/consistency/crossing_planes.hpp>

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include <lamina/backend/association/outlines.hpp>

namespace lamina {
namespace {

// What a level scanner saw of an upright plane from one point to the other, half a metre up.
PlaneLandmark face(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double height = 0.5) {
  const Eigen::Vector2d along = (to - from).normalized();
  const Eigen::Vector3d normal(along.y(), -along.x(), 0);
  const std::array<Eigen::Vector3d, 2> ends{Eigen::Vector3d(from.x(), from.y(), height),
                                            Eigen::Vector3d(to.x(), to.y(), height)};
  PlaneLandmark plane = PlaneLandmark::at(Plane(normal, normal.dot(ends[0])), ends[0]);
  plane.T_map_outline = plane_frame(plane.plane_map(), plane.anchor_map);
  plane.outline = OutlineGrid(0.1);
  grow_outline(plane, ends);
  return plane;
}

bool crosses(const PlaneLandmark& small, const PlaneLandmark& large) {
  return cross(small, std::array{&large});
}

TEST(CrossingPlanes, LinesOfOneFaceThatAreTurnedGoThroughIt) {
  const PlaneLandmark pillar = face({0, 1}, {0.6, 1});
  EXPECT_TRUE(crosses(face({0, 0.98}, {0.6, 1.02}), pillar));
  EXPECT_TRUE(crosses(face({0, 1.03}, {0.6, 0.985}, 0.7), pillar));  // as the scanner leans
  const PlaneLandmark wall = face({-8, 1}, {8, 1});
  EXPECT_TRUE(crosses(face({2, 0.98}, {3.4, 1.03}), wall));
}

TEST(CrossingPlanes, WhatLiesBeforeAFaceOrMeetsItAtOneEndDoesNot) {
  const PlaneLandmark wall = face({-8, 1}, {8, 1});
  EXPECT_FALSE(crosses(face({2, 0.97}, {3, 0.97}), wall));      // a panel
  EXPECT_FALSE(crosses(face({2, 1.005}, {2.9, 0.95}), wall));   // a door ajar
  EXPECT_FALSE(crosses(face({2, 0.85}, {3, 1.15}), wall));      // too far off to be noise
  EXPECT_FALSE(crosses(face({7.8, 0.98}, {8.8, 1.02}), wall));  // beyond its end
  EXPECT_FALSE(crosses(face({3.4, 1.03}, {2, 0.98}), wall));    // seen from behind
  EXPECT_FALSE(cross(face({2, 0.98}, {3.4, 1.03}), {}));
  PlaneLandmark unseen = wall;
  unseen.outline = OutlineGrid(0.1);
  EXPECT_FALSE(crosses(face({2, 0.98}, {3.4, 1.03}), unseen));
}

}  // namespace
}  // namespace lamina
