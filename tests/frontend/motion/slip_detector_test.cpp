// Wheels that slip step by step, and noise that only looks so.
#include <gmock/gmock.h>

#include <lamina/frontend/motion/scan_odometry.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

constexpr double kWheels = 2e-5, kScan = 1e-4;  // m^2
// 1-sigma of a compromise against what wheels said.
const double kUsual = kWheels / std::sqrt(kWheels + kScan);

TEST(SlipDetector, NoiseIsHardlyEverDoubted) {
  SlipDetector doubt;
  std::mt19937 rng(3);
  std::normal_distribution<double> noise(0, kUsual);
  int suspected = 0;
  for (int i = 0; i < 10000; ++i) {
    doubt.add(noise(rng), kWheels, kScan);
    suspected += doubt.slips();
  }
  EXPECT_LT(suspected, 200);
}

TEST(SlipDetector, AFewStepsOfTwoSigmasOneWayAreDoubted) {
  SlipDetector doubt;
  for (int i = 0; i < 4; ++i) doubt.add(-2 * kUsual, kWheels, kScan);
  EXPECT_TRUE(doubt.slips());
  for (int i = 0; i < 10; ++i) doubt.add(0, kWheels, kScan);
  EXPECT_FALSE(doubt.slips());
}

TEST(SlipDetector, ForgetsWhatNothingTells) {
  SlipDetector doubt;
  for (int i = 0; i < 4; ++i) {
    doubt.add(-2 * kUsual, kWheels, kScan);
    if (i == 1) doubt.forget();
  }
  EXPECT_FALSE(doubt.slips());
}

// How far off the end is that wheels with a noise of 2 cm per root metre have slipped by 0.75 m on
// the way to.
double off_by_slip(bool robust, bool slopes = false) {
  ScanOdometryOptions options;
  options.robust_wheels = robust;
  ScanOdometry odometry(options);
  testing::Scanner scanner;
  scanner.fov = M_PI;
  scanner.range_max = 8;
  constexpr double kStep = 0.05;  // m
  SE3 T;
  for (int i = 0; i < 90; ++i) {
    std::optional<MotionGuess> wheels;
    if (i > 0) {
      const double slip = i >= 40 && i < 65 ? 0.03 : 0;
      wheels = MotionGuess{SE3::planar(kStep + slip, 0, 0), Matrix6d::Identity() * 1e-6};
      wheels->covariance(0, 0) = 4e-4 * (kStep + slip);
      wheels->covariance(1, 1) = wheels->covariance(5, 5) = 4e-4 * kStep;
    }
    const LaserScan scan = scanner.scan(testing::niches(), SE3::planar(kStep * i, 0, 0), 0.1 * i);
    T = T * odometry.process(scan, wheels, slopes).T_prev_curr_body;
  }
  return std::abs(T.translation().x() - 89 * kStep);
}

TEST(SlipDetector, NichesTellHowFarACorridorGoesWhereWheelsSlip) {
  EXPECT_LT(off_by_slip(true), 0.1);
  EXPECT_LT(off_by_slip(false), 0.1);
}

// There returns may be the ground's.
TEST(SlipDetector, NotWhereTheGroundChangesItsSlope) { EXPECT_GT(off_by_slip(false, true), 0.3); }

}  // namespace
}  // namespace lamina
