// When the whole map has its turn.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/backend/mapper/online_maintenance.hpp>

#include "backend/mapper/mapper_room.hpp"

namespace lamina {
namespace {

// Keyframes along the room.
struct Met {
  const made_up::Drive way;
  made_up::Sensor sensor;
  Mapper mapper;
  OnlineUpkeep upkeep;
  std::size_t frames = 0;
  int keyframes = 0;
  bool sees_floor = false, kept_up = true;

  explicit Met(unsigned seed, int all = 60, int lap = 180, const MapperOptions& options = {})
      : way(all, lap, seed), sensor(seed + 1), mapper(options) {}
  void drive(std::size_t more) {
    const auto room = made_up::make_room();
    for (const std::size_t end = frames + more; frames < end; ++frames) {
      Observations seen = sensor.depth(way.truth[frames], made_up::at_frame(frames), room);
      if (sees_floor) made_up::add_floor(seen, sensor);
      const auto added =
          mapper.add(seen, frames == 0 ? way.truth[0] : way.increments[frames - 1], way.covariance);
      if (kept_up) upkeep.added(added, mapper);
      keyframes += added.is_keyframe;
    }
  }
  // From the first keyframe to the last, `off` metres from what the map has.
  bool loop(double off) {
    const Keyframe &a = mapper.graph().keyframes.front(), &b = mapper.graph().keyframes.back();
    const SE3 T = a.T_map_body.inverse() * b.T_map_body;
    return mapper.add_loop(a.id, b.id, SE3::planar(off, 0, 0) * T, 1e-4 * Matrix6d::Identity());
  }
};

TEST(OnlineUpkeep, LoopsOfAMapThatWasJustRefinedAreAskedFirst) {
  Met met(31);
  met.drive(30);
  ASSERT_GT(met.keyframes, 3);
  EXPECT_FALSE(met.upkeep.due(0, met.mapper));  // no loop
  ASSERT_TRUE(met.loop(0));
  EXPECT_TRUE(met.upkeep.due(1, met.mapper));  // never refined
  met.upkeep.refine(met.mapper);
  ASSERT_TRUE(met.loop(0));
  EXPECT_FALSE(met.upkeep.due(1, met.mapper));
  ASSERT_TRUE(met.loop(0.2));
  EXPECT_TRUE(met.upkeep.due(1, met.mapper));
}

TEST(OnlineUpkeep, AGraphThatHasGrownIsDue) {
  Met met(32);
  met.drive(30);
  met.upkeep.refine(met.mapper);
  ASSERT_TRUE(met.loop(0));
  ASSERT_FALSE(met.upkeep.due(1, met.mapper));
  met.drive(30);
  ASSERT_TRUE(met.loop(0));
  EXPECT_TRUE(met.upkeep.due(1, met.mapper));
}

// Each frame sees floor from 1 to 3 m ahead, most of which the one before saw as well.
TEST(OnlineUpkeep, FloorIsMadeOneOnTheWay) {
  MapperOptions options;
  options.window.keyframes = 5;
  Met met(35, 180, 180, options), as_seen(35, 180, 180, options);
  met.sees_floor = as_seen.sees_floor = true;
  as_seen.kept_up = false;
  met.drive(180);
  as_seen.drive(180);
  const std::size_t squares = met.mapper.state().surfels.size();
  const std::size_t all_squares = as_seen.mapper.state().surfels.size();
  EXPECT_LT(3 * squares, 2 * all_squares);  // 25 keyframes and the window are as they were seen
  const PlanarMap map = met.mapper.map(), all = as_seen.mapper.map();
  const auto rms = [](const PlanarMap& m) {
    double sum = 0;
    for (const auto& s : m.surfels) sum += s.center.z() * s.center.z();
    return std::sqrt(sum / static_cast<double>(m.surfels.size()));
  };
  ASSERT_GT(all.surfels.size(), 500U);
  EXPECT_GT(map.surfels.size(), 0.9 * static_cast<double>(all.surfels.size()));
  EXPECT_LT(rms(map), 1.1 * rms(all) + 1e-4);
  met.mapper.condense_newest_floor();
  const std::size_t fewer = met.mapper.state().surfels.size();
  EXPECT_LT(fewer, squares);
  met.mapper.condense_newest_floor();  // nothing is new
  EXPECT_EQ(met.mapper.state().surfels.size(), fewer);
}

// A second lap's keyframes go, and older ones are left their floor: it takes no room there.
TEST(OnlineUpkeep, FloorThatIsLeftToOlderKeyframesIsMadeOneWithTheirs) {
  MapperOptions options;
  options.window.keyframes = 5;
  Met met(36, 420, 180, options);
  met.sees_floor = true;
  met.drive(200);
  met.upkeep.refine(met.mapper);
  const std::size_t squares = met.mapper.state().surfels.size();
  const std::size_t keyframes = met.mapper.graph().keyframes.size();
  met.drive(160);
  ASSERT_LT(met.mapper.graph().keyframes.size(), keyframes + 20);
  met.mapper.condense_newest_floor();
  const std::size_t more = met.mapper.state().surfels.size();
  EXPECT_LT(more, squares + squares / 3);
  // What was seen is there, once.
  const auto count = [](const Mapper& mapper) {
    std::int64_t sum = 0;
    const MapState map = mapper.state();
    const SurfelFloor floor = map.surfels.solve(map.graph, {});
    for (const auto& [key, cell] : floor.cells()) sum += cell.evidence.count();
    return sum;
  };
  EXPECT_EQ(count(met.mapper), 9 * 200 * 360);
}

// A bare corridor closes no loops; what laps of it see again must not pile up all the same.
TEST(OnlineUpkeep, LapsWithoutALoopAreDueWhenAllWasSeenAgain) {
  Met met(34, 240, 60);
  met.drive(60);
  met.upkeep.refine(met.mapper);
  EXPECT_FALSE(met.upkeep.due(0, met.mapper));
  met.drive(180);
  EXPECT_TRUE(met.upkeep.due(0, met.mapper));
}

// A second lap that does not know the first one's planes keeps its keyframes until those are
// merged.
TEST(OnlineUpkeep, WhatHadToStayIsAskedAgain) {
  MapperOptions options;
  options.place.enabled = false;
  options.window.keyframes = 8;
  options.association.max_distance_m = 0.02;
  Met met(1, 240, 120, options);
  met.drive(240);
  const std::size_t before = met.mapper.graph().keyframes.size();
  met.upkeep.refine(met.mapper);
  EXPECT_LT(met.mapper.graph().keyframes.size(), before);
  const std::size_t after = met.mapper.graph().keyframes.size();
  met.mapper.retire_again();  // once
  EXPECT_EQ(met.mapper.graph().keyframes.size(), after);
}

// Planes that seem new at places that are known are hardly so: laps of them must not pile up
// either.
TEST(OnlineUpkeep, KnownPlacesWhosePlanesSeemNewAreDue) {
  MapperOptions options;
  options.place.enabled = false;
  options.window.keyframes = 8;
  options.association.max_distance_m = 0.02;
  Met met(1, 360, 120, options);
  met.drive(120);
  met.upkeep.refine(met.mapper);
  EXPECT_FALSE(met.upkeep.due(0, met.mapper));
  met.drive(240);
  EXPECT_GT(met.mapper.waiting(), 0u);
  EXPECT_TRUE(met.upkeep.due(0, met.mapper));
}

}  // namespace
}  // namespace lamina
