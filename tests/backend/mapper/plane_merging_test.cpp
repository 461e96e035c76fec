// Merges of planes of a map, and what takes them back.
#include <gtest/gtest.h>

#include <algorithm>

#include <lamina/backend/mapper/plane_merging.hpp>

#include "backend/mapper/corner_map.hpp"

namespace lamina {
namespace {

using namespace made_up;  // NOLINT

std::ptrdiff_t views_of(const WorkingMap& map, PlaneId id) {
  return std::count_if(map.graph.plane_moments.begin(), map.graph.plane_moments.end(),
                       [id](const PlaneMomentsFactor& f) { return f.plane == id; });
}

// A corner whose floor is there twice, the second from another keyframe.
struct TwoFloors {
  WorkingMap map = make_corner();
  PlaneId first = PlaneId(0), second;
  PlaneMerging merging;
  TwoFloors() {
    add_keyframe(map, SE3::from_translation({0.5, 0, 0}));
    second = add_plane(map, corner_planes()[0]);
  }
};

TEST(PlaneMerging, JoinedPlanesAreOneInGraphWindowAndOutlines) {
  TwoFloors floors;
  floors.merging.join(floors.map, floors.second, floors.first);
  EXPECT_EQ(successor_of(floors.map.graph, floors.second), floors.first);
  EXPECT_FALSE(floors.map.window.contains(floors.second));
  EXPECT_EQ(views_of(floors.map, floors.first), 2);
  EXPECT_EQ(floors.map.outlines.at(floors.first).size(), 2u);
  EXPECT_EQ(floors.map.outlines.count(floors.second), 0u);
}

TEST(PlaneMerging, AnUndoneMergeGivesEachPlaneItsViews) {
  TwoFloors floors;
  floors.merging.join(floors.map, floors.second, floors.first);
  ASSERT_TRUE(floors.merging.undo(floors.map, floors.second));
  EXPECT_TRUE(floors.map.graph.at(floors.second).active);
  EXPECT_EQ(views_of(floors.map, floors.first), 1);
  EXPECT_EQ(views_of(floors.map, floors.second), 1);
  EXPECT_EQ(floors.map.outlines.at(floors.first).size(), 1u);
  EXPECT_FALSE(floors.merging.undo(floors.map, floors.second)) << "it is not merged any more";
}

TEST(PlaneMerging, WhatStoodThroughTwoRefinementsStays) {
  TwoFloors floors;
  floors.merging.join(floors.map, floors.second, floors.first);
  floors.merging.refined();
  floors.merging.refined();
  EXPECT_FALSE(floors.merging.undo(floors.map, floors.second));
}

// How many merges are undone when the refiner rejects all that `views` keyframes saw of the second.
std::size_t undone_of(int views) {
  TwoFloors floors;
  WorkingMap& map = floors.map;
  for (int k = 1; k < views; ++k) {
    add_keyframe(map, SE3::from_translation({0.5, 0.1 * k, 0}));
    map.observe(floors.second, evidence_of(corner_planes()[0], map.T_map_keyframe()), Timestamp());
  }
  floors.merging.join(map, floors.second, floors.first);
  for (auto& f : map.graph.plane_moments) f.weight = f.keyframe == KeyframeId(0) ? 1 : 0;
  PlanePairs apart;
  const std::size_t undone =
      floors.merging.undo_contradicted(map, {{floors.second, floors.first}}, apart);
  EXPECT_EQ(apart.size(), undone);
  return undone;
}

TEST(PlaneMerging, AMergeThatTheRefinerRejectsIsUndone) { EXPECT_EQ(undone_of(2), 1u); }

TEST(PlaneMerging, OneRejectedViewIsMistakenNotAnotherSurface) { EXPECT_EQ(undone_of(1), 0u); }

}  // namespace
}  // namespace lamina
