// A scanner that turns to and fro in a room, with a beam that takes its time or does not.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <lamina/frontend/odometry/sweep_finder.hpp>

namespace lamina {
namespace {

constexpr double kInterval = 0.1;  // s between scans
constexpr int kBeams = 241;

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

// Heading: rests, turns one way, rests, turns back.
double heading_at(double t) {
  constexpr double kRate = 1, kRest = 1, kTurn = 2;  // rad/s, s
  const double period = 2 * (kRest + kTurn), phase = std::fmod(t, period);
  if (phase < kRest) return 0;
  if (phase < kRest + kTurn) return kRate * (phase - kRest);
  if (phase < 2 * kRest + kTurn) return kRate * kTurn;
  return kRate * (period - phase);
}

// What is found of a beam that takes `sweep`, of scans over `seconds`; `jitter` of their stamps and
// `clutter` (m) that ranges are off by beyond their noise, as where soft things move.
struct Faults {
  double jitter = 0, clutter = 0;
};
std::optional<SweepFinder::Found> found(double sweep, double seconds, double stated = 0,
                                        const Faults& faults = {}) {
  SweepFinder finder;
  std::mt19937 rng(3);
  std::normal_distribution<double> noise(0, 0.01);
  for (int k = 0; k * kInterval < seconds; ++k) {
    const double t = k * kInterval;
    LaserScan scan;
    scan.stamp = Timestamp::from_seconds(1000 + t + (k % 40 == 7 ? faults.jitter : 0));
    scan.angle_min = -2.1;
    scan.angle_increment = 4.2 / (kBeams - 1);
    scan.range_max = 20;
    scan.time_increment = stated;
    scan.lidar.noise.range_sigma = 0.01;
    for (int i = 0; i < kBeams; ++i) {
      const double angle = scan.angle_min + i * scan.angle_increment +
                           heading_at(t + std::abs(sweep) + sweep * i / (kBeams - 1));
      const double range = range_in_room({0.3, -0.4}, {std::cos(angle), std::sin(angle)});
      const double off = i % 3 == k % 3 ? faults.clutter * (100 * noise(rng)) : 0;
      scan.ranges.push_back(static_cast<float>(range + noise(rng) + off));
    }
    const double at = t + std::abs(sweep);
    Vector6d velocity = Vector6d::Zero();
    velocity(5) = (heading_at(at + 0.01) - heading_at(at)) / 0.01;
    finder.add(scan, {0.3, -0.4, heading_at(at)}, velocity);
  }
  return finder.found();
}

TEST(SweepFinder, TellsSweepsOfEitherOrder) {
  for (const double sweep : {0.08, -0.05}) {
    const auto told = found(sweep, 20);
    ASSERT_TRUE(told) << sweep;
    EXPECT_NEAR(told->sweep, sweep, 0.003);
    EXPECT_LT(told->sigma, 0.003);
  }
}

// One stamp that comes close to the next does not make the scanner a fast one, and where most of
// what scans are off by has other reasons the sweep is still told.
TEST(SweepFinder, BadStampsAndClutterDoNotHideIt) {
  for (const Faults& faults : {Faults{0.09, 0}, Faults{0, 0.04}}) {
    const auto told = found(0.07, 30, 0, faults);
    ASSERT_TRUE(told) << faults.jitter;
    EXPECT_NEAR(told->sweep, 0.07, 0.006);
  }
  EXPECT_FALSE(found(0, 30, 0, {0.09, 0.04}));
}

TEST(SweepFinder, BeamsAtOnceStayAtOnce) { EXPECT_FALSE(found(0, 20)); }

TEST(SweepFinder, FewTurnsTellNothing) { EXPECT_FALSE(found(0.08, 2)); }

TEST(SweepFinder, ScansThatSayItAreNotAsked) { EXPECT_FALSE(found(0.08, 20, 1e-4)); }

}  // namespace
}  // namespace lamina
