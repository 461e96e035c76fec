// The grid of a run's scans, for any number of threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <lamina/grid/evidence/occupancy_builder.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

constexpr int kScans = 150;  // more than two threads take at once

// Every third scan has a beam that goes on behind the wall.
struct Drive {
  std::vector<KeptScan> scans;
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
  GridOptions options;
  options.threads = threads;
  const auto each = [&](const auto& take) {
    for (const KeptScan& kept : drive.scans) take(kept);
  };
  const ScanOccupancy seen = occupancy_of_scans(each, drive.trajectory, GroundHits({}), options);
  const GridGeometry all{options.resolution, {-400, -400}, 800, 800};
  std::vector<float> pixels(800 * 800);
  for (int row = 0; row < 800; ++row) seen.grid->image_row(all, row, pixels.data() + 800 * row);
  return pixels;
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

// A scanner of 5 m range between two walls 1 m to its sides, 4.9 m long ahead, with nothing behind
// it: what returns from afar shows that it would have seen more.
struct OpenEnd {
  std::vector<KeptScan> scans;
  Trajectory trajectory;

  // `empty`: what stands for no return; `shut`: a wall at 3 m that never returns is there, and
  // returns in half of the scans.
  OpenEnd(float empty, bool dark) {
    constexpr int kBeams = 181;
    for (int t = 0; t < 40; ++t) {
      LaserScan scan;
      scan.stamp = Timestamp::from_seconds(t);
      scan.angle_min = -M_PI / 2;
      scan.angle_increment = M_PI / (kBeams - 1);
      scan.range_min = 0.05;
      scan.range_max = 5;
      scan.lidar.T_body_lidar = SE3(SO3(), {0, 0, 0.4});
      for (int i = 0; i < kBeams; ++i) {
        const double a = scan.angle(static_cast<std::size_t>(i));
        const double side = 1 / std::max(1e-9, std::abs(std::sin(a))), end = 3 / std::cos(a);
        double range = side < 5 ? side : 0;
        if (dark && end < side) range = t % 2 == 0 ? end : 0;
        scan.ranges.push_back(range > 0 ? static_cast<float>(range) : empty);
      }
      scans.push_back({scan, false});
      trajectory.add(scan.stamp, SE3());
    }
  }
};

float ahead(const OpenEnd& drive, NoReturn mode, double x) {
  GridOptions options;
  options.no_return_is_free = mode;
  const auto each = [&](const auto& take) {
    for (const KeptScan& kept : drive.scans) take(kept);
  };
  const ScanOccupancy seen = occupancy_of_scans(each, drive.trajectory, GroundHits({}), options);
  return seen.grid->probability(cell_of({x, 0.0}, options.resolution));
}

TEST(NoReturnIsFree, WhereTheScannerReturnsFromThatFar) {
  for (const float empty : {0.0F, HUGE_VALF, 5.0F}) {
    const OpenEnd open(empty, false);
    EXPECT_LT(ahead(open, NoReturn::kAuto, 4.5), 0.196F) << empty;
    EXPECT_LT(ahead(open, NoReturn::kTrue, 4.5), 0.196F) << empty;
    EXPECT_TRUE(std::isnan(ahead(open, NoReturn::kFalse, 4.5))) << empty;
    EXPECT_TRUE(std::isnan(ahead(open, NoReturn::kAuto, 5.5))) << empty;
  }
}

// NaN is a failure [REP117].
TEST(NoReturnIsFree, NotWhereBeamsFailed) {
  const OpenEnd failed(std::numeric_limits<float>::quiet_NaN(), false);
  EXPECT_TRUE(std::isnan(ahead(failed, NoReturn::kAuto, 4.5)));
  EXPECT_TRUE(std::isnan(ahead(failed, NoReturn::kTrue, 4.5)));
}

// A wall that half of the scans do not see: no return means nothing there.
TEST(NoReturnIsFree, NotWhereBeamsWentThroughWalls) {
  const OpenEnd dark(HUGE_VALF, true);
  EXPECT_TRUE(std::isnan(ahead(dark, NoReturn::kAuto, 4.5)));
  EXPECT_GT(ahead(dark, NoReturn::kAuto, 3.0), 0.65F);
  EXPECT_TRUE(std::isnan(ahead(dark, NoReturn::kTrue, 4.5))) << "no ray clears behind a wall";
}

// On the left side walls go out of range; on the right a wall at 3 m never returns, black or glass.
// What tells it from open space is that the wall beside it ends too near.
TEST(NoReturnIsFree, NotBehindWhatNeverReturns) {
  OpenEnd black(HUGE_VALF, false);
  for (KeptScan& kept : black.scans) {
    for (std::size_t i = 0; i < kept.scan.size(); ++i) {
      float& r = kept.scan.ranges[i];
      const double a = kept.scan.angle(i);
      if (a < 0 && static_cast<double>(r) * std::cos(a) > 3) r = HUGE_VALF;
    }
  }
  EXPECT_TRUE(std::isnan(ahead(black, NoReturn::kAuto, 4.5)));
  EXPECT_LT(ahead(black, NoReturn::kTrue, 4.5), 0.196F);
}

// A scanner that claims 5 m and sees 1.5: nothing shows that it would have seen more.
TEST(NoReturnIsFree, NotWhereNothingReturnedFromAfar) {
  OpenEnd near(HUGE_VALF, false);
  for (KeptScan& kept : near.scans) {
    for (float& r : kept.scan.ranges) r = r < 1.5F ? r : HUGE_VALF;
  }
  EXPECT_TRUE(std::isnan(ahead(near, NoReturn::kAuto, 4.5)));
}

}  // namespace
}  // namespace lamina
