// Scans that fit nowhere while wheels go on, or stand.
#include <gmock/gmock.h>

#include <cmath>

#include <lamina/frontend/motion/scan_odometry.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

using testing::drive;
using testing::guess;
using testing::room;
using testing::Scanner;

struct Hidden {
  ScanMotion motion;  ///< of the hidden scan
  SE3 off;            ///< of the last pose
};

/// People stand around the scanner for one scan, in which wheels go on, or stand.
Hidden hide(bool stand) {
  constexpr int kHidden = 30, kSteps = 35;
  ScanOdometry odometry;
  Scanner scanner;
  const std::vector<testing::Wall> people = {{{-0.4, -0.3}, {0.5, -0.45}},
                                             {{0.5, -0.45}, {0.4, 0.6}},
                                             {{0.4, 0.6}, {-0.3, 0.35}},
                                             {{-0.3, 0.35}, {-0.4, -0.3}}};
  Hidden result;
  SE3 T;
  for (int i = 0; i < kSteps; ++i) {
    const bool hidden = i == kHidden;
    std::optional<MotionGuess> g;
    if (i > 0) g = guess(drive(i - 1).inverse() * drive(i), 0.01, 0.05);
    if (hidden && stand) g->T_prev_curr_body = SE3();
    const SE3 at = hidden ? SE3() : drive(i);
    const ScanMotion m = odometry.process(scanner.scan(hidden ? people : room(), at, 0.1 * i), g);
    T = T * m.T_prev_curr_body;
    if (hidden) result.motion = m;
  }
  result.off = (drive(0).inverse() * drive(kSteps - 1)).inverse() * T;
  return result;
}

// By their own noise.
TEST(ScanOdometry, OneScanThatFitsNowhereIsWhereWheelsThatGoOnSay) {
  const Hidden hidden = hide(false);
  EXPECT_EQ(hidden.motion.status, ScanMotion::Status::kPredicted);
  EXPECT_TRUE(hidden.motion.wheels_went_on);
  EXPECT_NEAR(std::sqrt(hidden.motion.covariance(0, 0)), 0.01, 0.01);
  EXPECT_LT(hidden.off.translation().norm(), 0.02);
  EXPECT_LT(hidden.off.so3().log().norm(), 0.01);
}

TEST(ScanOdometry, WhereWheelsStandTheRobotMayHaveBeenTakenAway) {
  const Hidden hidden = hide(true);
  EXPECT_EQ(hidden.motion.status, ScanMotion::Status::kPredicted);
  EXPECT_FALSE(hidden.motion.wheels_went_on);
}

}  // namespace
}  // namespace lamina
