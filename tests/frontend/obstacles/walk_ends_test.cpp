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
