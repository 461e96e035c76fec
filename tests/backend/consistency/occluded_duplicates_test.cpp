// Walls behind shelves and partitions, openings that were looked through, walls that stand apart.
#include <lamina/backend/consistency/occluded_duplicates.hpp>

#include <gtest/gtest.h>

#include <cmath>

namespace lamina {
namespace {

// A robot that drives along x, from -3 to 3 at y = 0, and sees walls that face it.
struct Room {
  Graph graph;
  std::map<PlaneId, std::vector<OutlinePiece>> outlines;
  DoubleOptions options;

  Room() {
    for (int i = -3; i <= 3; ++i)
      graph.add_keyframe(Timestamp::from_seconds(i + 3), SE3::from_translation({1.0 * i, 0, 0}));
    graph.keyframes.front().fixed = true;
    Vector6d sigma;
    sigma << 0.002, 0.002, 0.002, 0.001, 0.001, 0.001;
    for (std::size_t i = 1; i < graph.keyframes.size(); ++i) {
      graph.odometry.push_back({graph.keyframes[i - 1].id, graph.keyframes[i].id,
                                SE3::from_translation({1, 0, 0}),
                                Matrix6d(sigma.cwiseInverse().asDiagonal())});
    }
  }
  // A wall at y from x0 to x1, of which every keyframe saw all.
  PlaneId see(double y, double x0, double x1) {
    const Plane wall({0, -1, 0}, -y);
    const PlaneId id = graph.add_plane(PlaneLandmark::at(wall, {(x0 + x1) / 2, y, 0.5}));
    const NoiseFloor floor{options.association.surface_sigma_m,
                           options.association.surface_sigma_deg * M_PI / 180, 0};
    for (const Keyframe& keyframe : graph.keyframes) {
      const SE3 T_body_map = keyframe.T_map_body.inverse();
      Moments m;
      for (double x = x0; x <= x1; x += 0.1) {
        for (double z = 0; z <= 1; z += 0.1) m.add(T_body_map * Eigen::Vector3d(x, y, z), 1e4);
      }
      graph.plane_moments.push_back(
          {keyframe.id, id, m.discounted((T_body_map * wall).normal(), floor)});
      OutlinePiece piece{keyframe.id, {}};
      for (const auto& [x, z] : {std::pair(x0, 0.0), {x1, 0.0}, {x1, 1.0}, {x0, 1.0}})
        piece.points_body.push_back(T_body_map * Eigen::Vector3d(x, y, z));
      outlines[id].push_back(std::move(piece));
    }
    remake_outline(graph.at(id), outlines[id], graph, 0.1);
    return id;
  }
  std::size_t found(const std::set<std::pair<PlaneId, PlaneId>>& apart = {}) const {
    return find_occluded_duplicates(graph, outlines, apart, options).size();
  }
};

TEST(HiddenDoubles, AWallBehindAShelfIsOne) {
  Room room;
  const PlaneId left = room.see(2, -3, -0.9), right = room.see(2, 1.1, 4);
  EXPECT_EQ(room.found(), 1U);
  EXPECT_TRUE(find_doubles(room.graph, room.outlines, {}, room.options).empty());
  EXPECT_EQ(room.found({{left, right}}), 0U);
  EXPECT_EQ(room.found({{right, left}}), 0U);
  room.see(1.5, -0.9, 1.1);  // the shelf itself
  EXPECT_EQ(room.found(), 1U);
}

TEST(HiddenDoubles, WhatWasLookedThroughIsNotOneWall) {
  Room room;
  room.see(2, -3, -0.9), room.see(2, 1.1, 4);
  room.see(5, -2, 2);
  EXPECT_EQ(room.found(), 0U);
}

TEST(HiddenDoubles, NorIsWhatStandsFurtherBackOrFurtherApart) {
  Room back, apart, narrow;
  back.see(2, -3, -0.9), back.see(2.05, 1.1, 4);
  EXPECT_EQ(back.found(), 0U);
  apart.see(2, -3, -0.9), apart.see(2, 1.8, 4);
  EXPECT_EQ(apart.found(), 0U);
  narrow.see(2, -3, -0.9), narrow.see(2, 1.1, 1.6);  // of less than half of the gap
  EXPECT_EQ(narrow.found(), 0U);
}

TEST(HiddenDoubles, NearerPiecesAreTheOthersBusiness) {
  Room room;
  room.see(2, -3, -0.6), room.see(2, 0.6, 4);
  EXPECT_EQ(room.found(), 0U);
  EXPECT_EQ(find_doubles(room.graph, room.outlines, {}, room.options).size(), 1U);
}

TEST(HiddenDoubles, ThreePiecesBecomeOneTwoAtATime) {
  Room room;
  room.see(2, -6, -2), room.see(2, 0, 2), room.see(2, 4, 7);
  EXPECT_EQ(room.found(), 1U);
}

}  // namespace
}  // namespace lamina
