// Planes that turn out to be one when the whole graph is refined.
#include <gtest/gtest.h>

#include "mapper_room.hpp"

namespace lamina {
namespace {

using namespace made_up;  // NOLINT

// Of all seeds some doubles are left, short of the aim of 0.95: `laps_bench doubles`.
void expect_all_merged(const std::vector<unsigned>& seeds, int at_least) {
  Doubles doubles;
  for (const unsigned seed : seeds) {
    Mapper mapper = doubled(seed, make_room_with_slab());
    doubles.refine(mapper);
    EXPECT_TRUE(mapper.graph().problems().empty());
  }
  ASSERT_GT(doubles.before, at_least);
  EXPECT_EQ(doubles.strange, 0);
  EXPECT_EQ(doubles.wrong, 0);
  EXPECT_EQ(doubles.left, 0) << doubles.before << " doubles";
}

TEST(MapperMerge, ReSightingsOverTwoLapsBecomeOneAndNothingElseDoes) {
  expect_all_merged({1, 2, 3, 4}, 5);
}

TEST(MapperMerge, ALapThatWrongNamesHoldAsideComesBack) { expect_all_merged({13, 20}, 5); }

TEST(MapperMerge, AMergeIsTakenBackWithItsEvidence) {
  Mapper mapper = doubled(4, make_room());
  mapper.refine();
  const std::size_t merged = mapper.map().planes.size();
  PlaneId from = PlaneId::kNone;
  std::size_t factors = 0;
  for (const auto& plane : mapper.graph().planes) {
    if (!plane.active && plane.merged_into != PlaneId::kNone) from = plane.id;
  }
  ASSERT_NE(from, PlaneId::kNone);
  ASSERT_TRUE(mapper.undo_merge(from));
  EXPECT_EQ(mapper.map().planes.size(), merged + 1);
  for (const auto& f : mapper.graph().plane_moments) factors += f.plane == from ? 1 : 0;
  EXPECT_GE(factors, 1u);
  EXPECT_FALSE(mapper.undo_merge(from));
  EXPECT_TRUE(mapper.graph().problems().empty());
}

// Undoing, as refinement does, gives views of the present keyframe to other planes: the next frame
// of that keyframe finds none of its plane.
TEST(MapperMerge, FramesGoOnAfterTheKeyframesViewsWentToAnotherPlane) {
  constexpr unsigned kSeed = 2;
  const auto room = make_room();
  Mapper mapper = doubled(kSeed, room);
  mapper.refine();
  std::vector<PlaneId> merged;
  for (const auto& plane : mapper.graph().planes) {
    if (!plane.active && plane.merged_into != PlaneId::kNone) merged.push_back(plane.id);
  }
  const KeyframeId keyframe = mapper.graph().keyframes.back().id;
  bool of_this_keyframe = false;
  for (const PlaneId from : merged) {
    mapper.undo_merge(from);
    for (const auto& f : mapper.graph().plane_moments) {
      of_this_keyframe = of_this_keyframe || (f.keyframe == keyframe && f.plane == from);
    }
  }
  ASSERT_TRUE(of_this_keyframe);
  Sensor sensor(7);
  const SE3 here = Drive(360, 180, kSeed).truth.back();
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NO_THROW(mapper.add(sensor.depth(here, at_frame(400 + i), room), SE3(),
                               1e-8 * Matrix6d::Identity()));
  }
  EXPECT_TRUE(mapper.graph().problems().empty());
}

}  // namespace
}  // namespace lamina
