// How far wheels that are wrong lead a path astray, where nothing else tells it.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/frontend/motion/motion_covariances.hpp>
#include <lamina/io/figure_names.hpp>
#include <lamina/pipeline/calibration/path_uncertainty.hpp>

namespace lamina {
namespace {

const Eigen::Vector3d kUsual(0.05, 0.0087, 0.05);  // scale, drift (rad/m), turn scale

Step step_of(const SE3& moved, LeftToWheels left, double sigma = 1e-6) {
  Step step;
  step.motion = {moved, sigma * sigma * Matrix6d::Identity()};
  step.left_to_wheels = left;
  return step;
}

// From 100 m off the map's origin on; steps of 0.1 m ahead.
WheelPath path_of(int steps, LeftToWheels left, double sigma = 1e-6) {
  WheelPath path;
  path.add(step_of(SE3::planar(100, 0, 0), {}));
  for (int i = 0; i < steps; ++i) path.add(step_of(SE3::planar(0.1, 0, 0), left, sigma));
  return path;
}

TEST(WheelPath, WhatWasSeenCostsNothing) {
  const WheelPath path = path_of(400, {});
  EXPECT_EQ(path.alone(), 0);
  EXPECT_EQ(path.sigma(kUsual), 0);
  Diagnostics metrics;
  path.tell(kUsual, metrics);
  EXPECT_TRUE(io::by_name(metrics.counts).empty());
}

// Off by e s after s metres of an L: root mean square e L / sqrt(3).
TEST(WheelPath, ScaleLengthensACorridor) {
  const WheelPath path = path_of(400, {true, false});
  EXPECT_NEAR(path.way(), 40, 1e-6);
  EXPECT_EQ(path.heading(), 0);
  EXPECT_NEAR(path.sigma(kUsual), 0.05 * 40 / std::sqrt(3), 0.02);
  // Wheels that are known are believed.
  EXPECT_NEAR(path.sigma({0.002, 0.0087, 0.05}), 0.002 * 40 / std::sqrt(3), 0.001);
  WheelPath known = path;
  known.know({0.002, 0.001, 0.01});
  EXPECT_NEAR(known.sigma(kUsual), 0.002 * 40 / std::sqrt(3), 0.001);
}

// Aside by d s^2 / 2: root mean square d L^2 / (2 sqrt(5)).
TEST(WheelPath, DriftBendsAWay) {
  const WheelPath path = path_of(200, {false, true});
  EXPECT_NEAR(path.sigma(kUsual), 0.0087 * 20 * 20 / (2 * std::sqrt(5)), 0.02);
}

TEST(WheelPath, ThereAndBackScaleTakesItselfBack) {
  WheelPath path = path_of(200, {true, false});
  path.add(step_of(SE3::planar(0, 0, M_PI), {}));
  const double there = path.sigma(kUsual);
  for (int i = 0; i < 200; ++i) path.add(step_of(SE3::planar(0.1, 0, 0), {true, false}));
  EXPECT_NEAR(path.sigma(kUsual), there, 0.02);
}

// Two metres, and a long way on that scans tell: the heading lost is soon found again.
TEST(WheelPath, HeadingsAreFoundAgain) {
  WheelPath path = path_of(20, {false, true});
  for (int i = 0; i < 1000; ++i) path.add(step_of(SE3::planar(0.1, 0, 0), {}));
  EXPECT_LT(path.sigma(kUsual), 0.06);
}

// Ten of a hundred metres that scans saw were slip: so may be the forty that they did not see.
TEST(WheelPath, WheelsThatSlippedMaySlipUnseen) {
  WheelPath path = path_of(400, {true, false});
  for (int i = 0; i < 1000; ++i) {
    Step step = step_of(SE3::planar(0.1, 0, 0), {});
    step.wheels_moved = SE3::planar(0.11, 0, 0);
    step.scan_motion.emplace().T_prev_curr_body = step.motion.T_from_to;
    step.scan_motion->wheels_slipped = true;
    path.add(step);
  }
  EXPECT_NEAR(path.slipped(), 10, 1e-6);
  // 4 m at the end of the 40, and over the 100 m that follow.
  EXPECT_NEAR(path.sigma(Eigen::Vector3d::Zero()), 4 * std::sqrt((40. / 3 + 100) / 140), 0.05);
  Diagnostics metrics;
  path.tell(Eigen::Vector3d::Zero(), metrics);
  EXPECT_NEAR(metrics.counts.wheels_slipped_m, 10, 1e-6);
}

// 0.002 m a step as stated: 0.04 m after 400 steps, root mean square 0.04 / sqrt(2).
TEST(WheelPath, StatedNoiseCountsToo) {
  const WheelPath path = path_of(400, {true, false}, 0.002);
  EXPECT_NEAR(path.sigma(Eigen::Vector3d::Zero()), 0.04 / std::sqrt(2), 0.001);
}

// What was seen for half a metre in between does not end it, more does.
TEST(WheelPath, TheLongestStretchByWheelsAloneIsNamed) {
  WheelPath path;
  int i = 0;
  const auto go = [&](int steps, bool way) {
    for (; steps > 0; --steps, ++i) {
      Step step = step_of(SE3::planar(0.1, 0, 0), {way, false});
      step.observations.stamp = Timestamp::from_seconds(1000 + 0.5 * i);
      path.add(step);
    }
  };
  go(101, false);
  go(100, true);
  go(5, false);
  go(50, true);
  go(20, false);
  go(70, true);
  EXPECT_NEAR(path.longest().way, 15, 1e-6);
  Diagnostics metrics;
  path.tell(kUsual, metrics);
  EXPECT_NEAR(metrics.counts.way_by_wheels_alone_longest_from_s, 1050, 1e-6);
  EXPECT_NEAR(metrics.counts.way_by_wheels_alone_longest_to_s, 1127.5, 1e-6);
}

// One step in which the robot may have been carried off by a metre: "alone told 0 of 131 m, off by
// 1.7 m".
TEST(WheelPath, LostTrackingIsNotTheWheelsNoise) {
  WheelPath path = path_of(100, {});
  Step lost = step_of(SE3::planar(0.1, 0, 0), {true, true});
  lost.tracking_lost = true;
  lost.motion.covariance += carried_away();
  path.add(lost);
  for (int i = 0; i < 1000; ++i) path.add(step_of(SE3::planar(0.1, 0, 0), {}));
  EXPECT_NEAR(path.alone(), 0.1, 1e-6);
  EXPECT_LT(path.sigma(kUsual), 0.02);
}

}  // namespace
}  // namespace lamina
