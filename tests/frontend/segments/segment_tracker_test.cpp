// Tracks through rooms and over roofs, in any mounting.
#include <gtest/gtest.h>

#include <lamina/frontend/segments/segment_frontend.hpp>
#include <map>
#include <set>

#include "scan_maker.hpp"

namespace lamina {
namespace {
using test::ScanMaker;

TEST(SegmentFrontend, IdsDoNotSwitchOnALoopOfARoom) {
  ScanMaker maker;
  maker.beams = 541;
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  SegmentFrontend frontend;
  std::map<int, std::set<std::int64_t>> ids_of_wall;
  SE3 last;
  const int steps = 200;
  for (int k = 0; k < steps; ++k) {
    const double a = 2 * M_PI * k / steps;
    const SE3 T_map_body = SE3::planar(4 + 1.5 * std::cos(a), 3 + std::sin(a), a + M_PI / 2);
    const auto walls = test::room(8, 6, T_map_body.translation().x(), T_map_body.translation().y(),
                                  T_map_body.so3().yaw());
    std::vector<int> hits;
    LaserScan scan = maker.scan(walls, random, &hits);
    scan.stamp = Timestamp::from_seconds(0.1 * k);
    SE3 motion = last.inverse() * T_map_body;
    motion = motion *
             SE3::planar(0.005 * normal(random), 0.005 * normal(random), 0.003 * normal(random));
    last = T_map_body;
    const Observations out =
        frontend.process(scan, k == 0 ? std::optional<SE3>() : std::optional<SE3>(motion));
    for (const SegmentObservation& s : out.segments) {
      const int wall =
          hits[static_cast<std::size_t>((s.segment.first_beam + s.segment.last_beam) / 2)];
      if (s.track >= 0) ids_of_wall[wall].insert(s.track);
    }
  }
  EXPECT_EQ(ids_of_wall.size(), 4u);
  std::set<std::int64_t> all;
  for (const auto& [wall, ids] : ids_of_wall) {
    // The field of view is 270 degrees: a wall may leave it and come back as another.
    EXPECT_LE(ids.size(), 2u) << wall;
    for (const std::int64_t id : ids) EXPECT_TRUE(all.insert(id).second) << "shared " << id;
  }
}

TEST(SegmentFrontend, OddScansAreCountedAndTheirMotionKept) {
  ScanMaker maker;
  std::mt19937 random(2);
  SegmentFrontend frontend;
  LaserScan scan = maker.scan(test::room(8, 6, 4, 3, 0), random);
  for (int k = 0; k < 4; ++k) {
    scan.stamp = Timestamp::from_seconds(0.1 * k);
    frontend.process(scan, SE3());
  }
  const std::int64_t births = frontend.tracker().counts().births;
  EXPECT_TRUE(frontend.process(scan, SE3::planar(0.5, 0, 0)).segments.empty());
  scan.stamp = Timestamp::from_seconds(0.05);
  EXPECT_TRUE(frontend.process(scan, SE3()).segments.empty());
  scan.stamp = Timestamp::from_seconds(1);
  scan.ranges.clear();
  frontend.process(scan, SE3());
  scan.ranges.assign(100, 0.0F);
  frontend.process(scan, SE3());
  EXPECT_EQ(frontend.skipped().at("scan of repeated stamp"), 1);
  EXPECT_EQ(frontend.skipped().at("scan goes back in time"), 1);
  EXPECT_EQ(frontend.skipped().at("scan without beams"), 1);
  EXPECT_EQ(frontend.skipped().at("scan without returns"), 1);
  scan = maker.scan(test::room(8, 6, 4.5, 3, 0), random);
  scan.stamp = Timestamp::from_seconds(1.1);
  const Observations out = frontend.process(scan, SE3());
  EXPECT_GE(out.segments.size(), 3u);
  for (const SegmentObservation& s : out.segments) EXPECT_GE(s.track, 0);
  EXPECT_EQ(frontend.tracker().counts().births, births);
}

}  // namespace
}  // namespace lamina
