// What neighbouring walks must share before a rim is believed.
#include <gmock/gmock.h>

#include <lamina/frontend/obstacles/floor_walk.hpp>

namespace lamina {
namespace {

WalkEnd sharp_end(double range) {
  WalkEnd e;
  e.cause = BeamCause::kEdgeOfKnowledge;
  e.range = range;
  e.footprint = 0.02;
  e.gap = 1;
  e.sample = 50;
  e.sharp = true;
  return e;
}

WalkPlanes planes_below(const std::vector<float>& camera_heights) {
  WalkPlanes planes;
  for (const float height : camera_heights) planes.planes.emplace_back().camera_height = height;
  return planes;
}

TEST(WalkEnds, StraightRimsAreLedges) {
  std::vector<WalkEnd> ends;
  for (int j = 0; j < 20; ++j) ends.push_back(sharp_end(2 + 0.03 * j));
  find_ledges({}, ends);
  EXPECT_EQ(ends[10].cause, BeamCause::kLedge);
}

TEST(WalkEnds, RaggedEndsAndShadowsAreNot) {
  std::vector<WalkEnd> ragged, shadow;
  for (int j = 0; j < 20; ++j) {
    ragged.push_back(sharp_end(2 + 0.3 * (j * 7 % 5)));
    shadow.push_back(sharp_end(2));
    shadow.back().shadow = true;
  }
  find_ledges({}, ragged);
  find_ledges({}, shadow);
  for (const auto& e : ragged) EXPECT_EQ(e.cause, BeamCause::kEdgeOfKnowledge);
  for (const auto& e : shadow) EXPECT_EQ(e.cause, BeamCause::kEdgeOfKnowledge);
}

TEST(WalkEnds, RimsGoOnOverShortGaps) {
  std::vector<WalkEnd> ends(5, sharp_end(6));
  ends[2] = sharp_end(2);
  ends[2].cause = BeamCause::kHole;
  ends[3].bridged = {1.2F, 2.03F};
  ends[3].bridges = 2;
  ends[1].bridged = {1.2F};
  ends[1].bridges = 1;
  extend_rims(ends);
  EXPECT_EQ(ends[3].cause, BeamCause::kHole);
  EXPECT_NEAR(ends[3].range, 2.03, 1e-6);
  EXPECT_EQ(ends[1].cause, BeamCause::kEdgeOfKnowledge);
}

// Posts before a rim say nothing about it; lines that saw floor beyond it do.
TEST(WalkEnds, HolesAreBelievedPastPostsNotPastFloor) {
  const WalkPlanes floor = planes_below({0.6F});
  WalkEnd hole = sharp_end(1.5), between = sharp_end(1.2);
  hole.cause = BeamCause::kHole;
  hole.beyond = 1.55;
  between.cause = BeamCause::kObstacle;
  for (const double range : {1.2, 2.5}) {
    between.range = range;
    std::vector<WalkEnd> ends(30, between);
    for (const std::size_t j : {10U, 11U, 12U, 17U, 18U, 19U}) ends[j] = hole;
    settle_holes(floor, {}, ends);
    EXPECT_EQ(ends[12].cause, range < 1.5 ? BeamCause::kHole : BeamCause::kEdgeOfKnowledge);
    EXPECT_EQ(ends[12].barred, range > 1.5);
  }
}

// A camera 0.6 m up loses the floor beyond 4.1 m: there virtual projection says where the rim is.
// A rising ramp whose plane passes 0.9 m below the camera is seen up to 6 m, and so is its crest:
// the floor behind that is what was lost.
TEST(WalkEnds, WhereFloorIsLostDependsOnThePlaneWalkedOn) {
  const WalkPlanes planes = planes_below({0.6F, 0.9F});
  WalkEnd faded = sharp_end(4.5);
  faded.cause = BeamCause::kHole;
  faded.sharp = false;
  faded.faded = true;
  faded.beyond = 5.4;
  faded.beyond_footprint = 0.05;
  faded.history = 0xFFFF;
  for (const int plane : {0, 1}) {
    faded.plane = plane;
    std::vector<WalkEnd> ends(20, faded);
    settle_holes(planes, {}, ends);
    EXPECT_NEAR(ends[10].range, plane == 0 ? 5.35 : 4.5, 0.01);
  }
}

TEST(WalkEnds, SmoothingLeavesAStraightObliqueRimInPlace) {
  std::vector<WalkEnd> ends;
  for (int j = 0; j < 20; ++j) {
    ends.push_back(sharp_end(2 + 0.02 * j));
    ends.back().cause = BeamCause::kHole;
  }
  ends[10].range += 0.005;
  smooth_edges(ends);
  EXPECT_NEAR(ends[5].range, 2.10, 1e-9);
  EXPECT_NEAR(ends[10].range, 2.201, 1e-9);
}

}  // namespace
}  // namespace lamina
