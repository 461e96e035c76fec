// Platforms beside each other, a pit in a floor, edges and floors that bow.
#include <lamina/backend/association/level_separation.hpp>

#include <gtest/gtest.h>

#include <random>

#include <lamina/backend/consistency/merge_candidates.hpp>

namespace lamina {
namespace {

struct Area {
  double x0, x1, y0, y1;
};

// Level planes, and what keyframes at the origin saw of them.
struct Level {
  Graph graph;
  std::map<PlaneId, std::vector<OutlinePiece>> outlines;
  AssociationOptions options;
  std::mt19937 rng{1};

  explicit Level(int keyframes = 3) {
    for (int i = 0; i < keyframes; ++i) graph.add_keyframe(Timestamp::from_seconds(i), SE3());
  }
  // `slope`: rise along x about the area's middle. `shared`: m, by which each view's height is off.
  PlaneId see(const Area& area, double height, bool ground = false, double slope = 0,
              double shared = 0.001) {
    const Eigen::Vector3d middle((area.x0 + area.x1) / 2, (area.y0 + area.y1) / 2, height);
    const auto at = [&](double x, double y) {
      return Eigen::Vector3d(x, y, height + slope * (x - middle.x()));
    };
    const Plane plane = *Plane::from_normal_rho({-slope, 0, 1}, height - slope * middle.x());
    const PlaneId id = graph.add_plane(PlaneLandmark::at(plane, middle));
    (ground ? graph.at(id).votes.floor : graph.at(id).votes.sub_dominant) = 1;
    std::normal_distribution<double> noise(0, 0.001);
    for (const Keyframe& keyframe : graph.keyframes) {
      Moments m;
      for (double x = area.x0; x <= area.x1; x += 0.05) {
        for (double y = area.y0; y <= area.y1; y += 0.05) {
          m.add(at(x, y) + Eigen::Vector3d(0, 0, noise(rng)), 1e6);
        }
      }
      const NoiseFloor floor{std::hypot(shared, options.surface_sigma_m),
                             std::hypot(0.001, options.surface_sigma_deg * M_PI / 180), 0};
      graph.plane_moments.push_back({keyframe.id, id, m.discounted(plane.normal(), floor)});
      outlines[id].push_back({keyframe.id,
                              {at(area.x0, area.y0), at(area.x1, area.y0), at(area.x1, area.y1),
                               at(area.x0, area.y1)}});
    }
    remake_outline(graph.at(id), outlines[id], graph, 0.1);
    return id;
  }
  bool between(PlaneId a, PlaneId b) const {
    return LevelGaps(graph, outlines, options).between(a, b);
  }
  bool step(PlaneId a, PlaneId b) const { return LevelGaps(graph, outlines, options).step(a, b); }
};

constexpr Area kRoom{0, 4, -2, 2}, kLeft{1, 2, 0.6, 1.6}, kRight{1, 2, -1.6, -0.6};

TEST(LevelGaps, TheFloorLiesBetweenTwoPlatforms) {
  Level level;
  const PlaneId floor = level.see(kRoom, 0, true);
  const PlaneId left = level.see(kLeft, 0.02), right = level.see(kRight, 0.03);
  EXPECT_TRUE(level.between(left, right));
  EXPECT_TRUE(level.between(right, left));
  EXPECT_FALSE(level.between(left, floor));
}

TEST(LevelGaps, AFloorOneCentimetreLowerLiesBetweenWhatHasEdgesToIt) {
  Level level;
  const PlaneId left = level.see(kLeft, 0.01), right = level.see(kRight, 0.02);
  EXPECT_FALSE(level.between(left, right));
  level.see(kRoom, 0, true);
  EXPECT_TRUE(level.between(left, right));
  // A bow of one surface: nobody saw edges.
  const PlaneId low = level.see({1, 2, -5, -4}, 0.001), high = level.see({1, 2, -3, -2}, 0.004);
  EXPECT_FALSE(level.between(low, high));
}

TEST(LevelGaps, NothingSeenBetweenTellsNothing) {
  Level level;
  EXPECT_FALSE(level.between(level.see(kLeft, 0.02), level.see(kRight, 0.03)));
}

TEST(LevelGaps, WhatStandsBetweenIsNotLower) {
  Level level;
  level.see(kRoom, 0, true);
  const PlaneId left = level.see(kLeft, 0.02), right = level.see(kRight, 0.02);
  level.see({0.5, 2.5, -0.6, 0.6}, 0.3);
  EXPECT_FALSE(level.between(left, right));
}

TEST(LevelGaps, AFloorGoesOnBeyondAPit) {
  Level level;
  const PlaneId here = level.see({0, 1, -1, 1}, 0, true), there = level.see({2, 3, -1, 1}, 0);
  level.see({1, 2, -1, 1}, -0.3);
  EXPECT_FALSE(level.between(here, there));
}

TEST(LevelGaps, AnEdgeIsAStepAllAlongItsBorder) {
  Level level;
  const PlaneId floor = level.see(kRoom, 0, true);
  EXPECT_TRUE(level.step(level.see(kLeft, 0.02), floor));
  EXPECT_FALSE(level.step(level.see(kRight, 0.002), floor));  // within the noise of both views
  // Far away and unsure: 2 cm of 1.2 cm each.
  EXPECT_FALSE(level.step(level.see({3, 3.5, -1, 1}, 0.02, false, 0, 0.012), floor));
}

TEST(LevelGaps, AFloorThatTookInAPieceStillHasItsEdges) {
  Level level;
  const PlaneId floor = level.see(kRoom, 0, true), plate = level.see(kLeft, 0.02);
  const PlaneId piece = level.see({3, 3.5, -1, -0.5}, 0.013);
  level.graph.merge_planes(piece, floor);
  auto& pieces = level.outlines[floor];
  pieces.insert(pieces.end(), level.outlines[piece].begin(), level.outlines[piece].end());
  level.outlines.erase(piece);
  EXPECT_TRUE(level.step(plate, floor));
  EXPECT_TRUE(level.step(floor, plate));
}

TEST(LevelGaps, AFloorThatBowsHasNoStep) {
  Level level;
  const PlaneId here = level.see({0, 2, -1, 1}, 0, true);
  const PlaneId there = level.see({2, 4, -1, 1}, 0.02, false, 0.02);
  EXPECT_FALSE(level.step(there, here));
}

TEST(LevelGaps, DoublesAreNotSoughtAcrossAFloorNorOverAnEdge) {
  Level level;
  level.see(kRoom, 0, true);
  level.see(kLeft, 0.02);
  level.see(kRight, 0.025);
  level.see({3, 3.6, -0.3, 0.3}, 0.01);
  DoubleOptions options;
  for (Keyframe& keyframe : level.graph.keyframes) keyframe.fixed = true;
  EXPECT_TRUE(find_doubles(level.graph, level.outlines, {}, options).empty());
  EXPECT_TRUE(find_slivers(level.graph, level.outlines, {}, options).empty());
}

TEST(Slivers, AFewTurnedViewsOfGroundThatSwellsAreItsOwn) {
  Level level(2);
  const PlaneId floor = level.see(kRoom, 0, true);
  const PlaneId turned = level.see({0.5, 3.5, -1, 1}, 0, false, 0.03);  // off by 4.5 cm at its ends
  DoubleOptions options;
  const auto slivers = [&] { return find_slivers(level.graph, level.outlines, {}, options); };
  EXPECT_TRUE(slivers().empty());
  options.ground_tilt[floor] = 0.02;
  const std::vector<std::pair<PlaneId, PlaneId>> one = {{turned, floor}};
  EXPECT_EQ(slivers(), one);
  options.ground_tilt[floor] = 0.01;  // three of its sigmas
  EXPECT_TRUE(slivers().empty());
  options.ground_tilt[floor] = 0.02;
  level.see(kLeft, 0.025, true);  // a platform with an edge on it
  EXPECT_EQ(slivers(), one);
}

}  // namespace
}  // namespace lamina
