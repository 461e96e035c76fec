// Planes through others, and what meets them only.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/backend/consistency/plane_ghosts.hpp>

namespace lamina {
namespace {

// A wall at y = 2, two metres wide, seen from forty keyframes.
struct World {
  Graph graph;
  std::map<PlaneId, std::vector<OutlinePiece>> outlines;

  World() {
    for (int i = 0; i < 40; ++i)
      graph.add_keyframe(Timestamp::from_seconds(i), SE3::from_translation({0.02 * i, 0, 0}));
    upright({-1, 2}, {1, 2}, 40);
  }
  // From a to b (in plan) and a metre high.
  PlaneId upright(const Eigen::Vector2d& a, const Eigen::Vector2d& b, int views) {
    const Eigen::Vector2d along = (b - a).normalized();
    const Eigen::Vector3d normal(along.y(), -along.x(), 0);
    const Eigen::Vector3d low(a.x(), a.y(), 0), end(b.x(), b.y(), 0), up(0, 0, 1);
    const PlaneId id = graph.add_plane(PlaneLandmark::at(Plane(normal, normal.dot(low)), low));
    for (int i = 0; i < views; ++i) {
      OutlinePiece piece{graph.keyframes[static_cast<std::size_t>(i)].id, {}};
      const SE3 T = graph.keyframes[static_cast<std::size_t>(i)].T_map_body.inverse();
      for (const Eigen::Vector3d& p :
           {low, end, Eigen::Vector3d(end + up), Eigen::Vector3d(low + up)})
        piece.points_body.push_back(T * p);
      outlines[id].push_back(std::move(piece));
    }
    graph.at(id).observations = views;
    remake_outline(graph.at(id), outlines[id], graph, 0.1);
    return id;
  }
  std::set<PlaneId> found() const { return ghosts(graph, outlines); }
};

TEST(Ghosts, WhatAFewViewsLaidThroughAWallIsNone) {
  World world;
  const PlaneId id = world.upright({-0.8, 1.75}, {0.8, 2.3}, 3);
  ASSERT_EQ(world.graph.planes.size(), 2U);
  EXPECT_EQ(world.found(), std::set<PlaneId>{id});
}

TEST(Ghosts, WhatMoreSawStays) {
  World world;
  world.upright({-0.8, 1.75}, {0.8, 2.3}, 5);
  EXPECT_TRUE(world.found().empty());
}

TEST(Ghosts, ADoorAjarStays) {
  World world;
  world.upright({0, 1.95}, {0.8, 1.6}, 3);
  EXPECT_TRUE(world.found().empty());
}

TEST(Ghosts, AWallThatEndsALittleLateStays) {
  World world;
  world.upright({0.2, 0.5}, {0, 2.4}, 3);
  EXPECT_TRUE(world.found().empty());
}

TEST(Ghosts, WhatGoesPastTheWallsEndStays) {
  World world;
  world.upright({0.9, 1.7}, {1.9, 2.3}, 3);
  EXPECT_TRUE(world.found().empty());
}

}  // namespace
}  // namespace lamina
