// The grid of a run's scans, for any number of threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include <lamina/apps/occupancy_of_scans.hpp>

#include "../frontend/odometry/planar_world.hpp"

namespace lamina::apps {
namespace {

constexpr int kScans = 150;  // more than two threads take at once

// Every third scan has a beam that goes on behind the wall.
struct Drive {
  std::vector<io::KeptScan> scans;
  Trajectory trajectory;
  Drive() {
    testing::Scanner scanner;
    scanner.beams = 61;
    scanner.T_body_lidar = SE3(SO3(), {0.1, 0, 0.4});
    for (int i = 0; i < kScans; ++i) {
      const SE3 T_map_body = SE3::planar(-1 + 0.01 * i, 0.2, 0.01 * i);
      scans.push_back({scanner.scan(testing::room(), T_map_body, i), false});
      if (i % 3 == 0) scans.back().scan.ranges[static_cast<std::size_t>(i % 61)] = 14;
      trajectory.add(Timestamp::from_seconds(i), T_map_body);
    }
  }
};

std::vector<float> image(const Drive& drive, int threads) {
  Settings settings;
  settings.threads = threads;
  const auto each = [&](const auto& take) {
    for (const io::KeptScan& kept : drive.scans) take(kept);
  };
  const ScanOccupancy seen = occupancy_of_scans(each, drive.trajectory, GroundHits({}), settings);
  return seen.grid->image({settings.grid_resolution, {-400, -400}, 800, 800});
}

std::size_t known(const std::vector<float>& pixels) {
  return static_cast<std::size_t>(
      std::count_if(pixels.begin(), pixels.end(), [](float p) { return !std::isnan(p); }));
}

TEST(OccupancyOfScans, IsTheSameForAnyNumberOfThreads) {
  const Drive drive;
  const std::vector<float> one = image(drive, 1);
  EXPECT_GT(known(one), 10000u);
  for (const int threads : {2, 3}) {
    const std::vector<float> several = image(drive, threads);
    ASSERT_EQ(several.size(), one.size());
    EXPECT_EQ(std::memcmp(several.data(), one.data(), one.size() * sizeof(float)), 0) << threads;
  }
}

}  // namespace
}  // namespace lamina::apps
