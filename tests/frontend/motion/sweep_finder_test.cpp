// A scanner that turns to and fro in a room, with a beam that takes its time or does not.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <lamina/frontend/motion/sweep_finder.hpp>

namespace lamina {
namespace {

constexpr double kInterval = 0.1;  // s between scans
constexpr int kBeams = 61;

// The range from `at` along `ray` to the walls of a room 8 x 6 m about the origin, or to the
// cupboard in its corner.
double range_in_room(const Eigen::Vector2d& at, const Eigen::Vector2d& ray) {
  const double x = ((ray.x() > 0 ? 4 : -4) - at.x()) / ray.x();
  const double y = ((ray.y() > 0 ? 3 : -3) - at.y()) / ray.y();
  double range = std::min(x, y);
  const double front = (1.8 - at.y()) / ray.y(), side = (2.5 - at.x()) / ray.x();
  if (front > 0 && at.x() + front * ray.x() > 2.5) range = std::min(range, front);
  if (side > 0 && at.y() + side * ray.y() > 1.8) range = std::min(range, side);
  return range;
}

// `clutter` (m): what ranges are off by beyond their noise, as where soft things move; `slip`: what
// is added to the share of a turn's rate that is known of one block.
struct Faults {
  double jitter = 0, clutter = 0, slip = 0;
};

// A scan whose beam takes `sweep` (negative: the last beam comes first), begun at a heading by a
// scanner that turns at a rate (rad/s).
LaserScan scan_at(double heading, double rate, double sweep, double clutter, std::mt19937& rng) {
  std::normal_distribution<double> noise(0, 0.01);
  LaserScan scan;
  scan.angle_min = -2.1;
  scan.angle_increment = 4.2 / (kBeams - 1);
  scan.range_max = 20;
  scan.lidar.noise.range_sigma = 0.01;
  for (int i = 0; i < kBeams; ++i) {
    const double angle =
        scan.angle_min + i * scan.angle_increment + heading + rate * sweep * i / (kBeams - 1);
    const double range = range_in_room({0.3, -0.4}, {std::cos(angle), std::sin(angle)});
    const double off = i % 3 == 0 ? clutter * (100 * noise(rng)) : 0;
    scan.ranges.push_back(static_cast<float>(range + noise(rng) + off));
  }
  return scan;
}

// What is found over so many blocks of 4 s, each of a scan at rest and three in a turn; of stamps
// one of which in a block is late.
std::optional<SweepFinder::Found> found(double sweep, int blocks, const Faults& faults = {},
                                        double stated = 0) {
  SweepFinder finder;
  std::mt19937 rng(3);
  for (int k = 0; k < 4 * blocks; ++k) {
    const int block = k / 4, step = k % 4;
    const double rate = step == 0 ? 0 : (block % 2 ? -1.5 : 1);  // rad/s
    const double heading = step * kInterval * rate;
    LaserScan scan = scan_at(heading, rate, sweep, faults.clutter, rng);
    const double late = step == 2 ? faults.jitter : 0;
    scan.stamp = Timestamp::from_seconds(1000 + 4 * block + step * kInterval + late);
    scan.time_increment = stated;
    Vector6d velocity = Vector6d::Zero();
    velocity(5) = rate;
    if (block == 2) velocity(5) *= 1 + faults.slip;
    finder.add(scan, {0.3, -0.4, heading}, velocity);
  }
  const auto observed = finder.found();
  return observed && observed->adoption.adopted ? observed : std::nullopt;
}

constexpr int kEnough = 9;  // blocks; eight are asked for

void expect_found(double sweep, double tolerance, const Faults& faults = {}) {
  const auto observed = found(sweep, kEnough, faults);
  ASSERT_TRUE(observed);
  EXPECT_NEAR(observed->sweep, sweep, tolerance);
  EXPECT_LT(observed->sigma, tolerance);
}

TEST(SweepFinder, TellsASweep) { expect_found(0.08, 0.004); }

TEST(SweepFinder, TellsASweepWhoseLastBeamComesFirst) { expect_found(-0.05, 0.004); }

// One stamp that comes close to the next does not make the scanner a fast one.
TEST(SweepFinder, BadStampsDoNotHideIt) { expect_found(0.07, 0.006, {0.09, 0}); }

// Where most of what scans are off by has other reasons the sweep is still told.
TEST(SweepFinder, ClutterDoesNotHideIt) { expect_found(0.07, 0.012, {0, 0.02}); }

TEST(SweepFinder, NoneIsFoundInBadStampsAndClutter) {
  EXPECT_FALSE(found(0, kEnough, {0.09, 0.04}));
}

TEST(SweepFinder, BeamsAtOnceStayAtOnce) { EXPECT_FALSE(found(0, kEnough)); }

TEST(SweepFinder, ATurnThatContradictsSevenOthersIsOutvoted) {
  EXPECT_TRUE(found(0.08, 8, {0, 0, -1.5}));
}

TEST(SweepFinder, FewTurnsTellNothing) { EXPECT_FALSE(found(0.08, 2)); }

TEST(SweepFinder, ScansThatSayItAreNotAsked) { EXPECT_FALSE(found(0.08, kEnough, {}, 1e-4)); }

}  // namespace
}  // namespace lamina
