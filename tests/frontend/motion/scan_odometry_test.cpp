// Scan odometry in worlds whose answer is known.
#include <gmock/gmock.h>

#include <Eigen/LU>

#include <lamina/frontend/motion/scan_odometry.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

using testing::corridor;
using testing::drive;
using testing::guess;
using testing::room;
using testing::Scanner;

/// Translation and heading error of `T` against `truth`.
std::pair<double, double> error(const SE3& truth, const SE3& T) {
  const SE3 d = truth.inverse() * T;
  return {d.translation().norm(), d.so3().log().norm()};
}

struct DriveResult {
  SE3 T_first_last;
  int lost = 0;
  ScanMotion last;
};

DriveResult run(Scanner scanner, double turn_error, bool wheels, int steps = 60) {
  ScanOdometry odometry;
  DriveResult result;
  for (int i = 0; i < steps; ++i) {
    std::optional<MotionGuess> g;
    if (wheels && i > 0) {
      SE3 d = drive(i - 1).inverse() * drive(i);
      d = SE3(SO3::rot_z((1 + turn_error) * d.so3().yaw()), d.translation());
      g = guess(d, 0.01, 0.02);
    }
    result.last = odometry.process(scanner.scan(room(), drive(i), 0.1 * i), g);
    result.T_first_last = result.T_first_last * result.last.T_prev_curr_body;
    result.lost += i > 0 && result.last.status != ScanMotion::Status::kTracked;
  }
  return result;
}

TEST(ScanOdometry, FollowsADriveThroughARoomWithoutWheels) {
  const DriveResult r = run(Scanner{}, 0, false);
  const auto [t, a] = error(drive(0).inverse() * drive(59), r.T_first_last);
  EXPECT_LT(t, 0.015);
  EXPECT_LT(a, 0.004);
  EXPECT_EQ(r.lost, 0);
}

// Radii and limits of a scanner of a centimetre would find no scan of this one where it should be.
TEST(ScanOdometry, FollowsByAScannerThatIsOffByTwentyCentimetres) {
  Scanner scanner;
  scanner.sigma = 0.2;
  const DriveResult r = run(scanner, 0.5, true);
  const auto [t, a] = error(drive(0).inverse() * drive(59), r.T_first_last);
  EXPECT_LT(t, 0.2);
  EXPECT_LT(a, 0.05);
  EXPECT_GE(r.last.matched, ScanOdometryOptions().sure_matched);
}

TEST(ScanOdometry, OverrulesWheelsThatTurnHalfTooMuch) {
  const DriveResult r = run(Scanner{}, 0.5, true);
  const auto [t, a] = error(drive(0).inverse() * drive(59), r.T_first_last);
  EXPECT_LT(t, 0.015);
  EXPECT_LT(a, 0.004);
}

TEST(ScanOdometry, MountingChangesNothing) {
  for (const SE3& mounting :
       {SE3(SO3::rot_z(2.0), {0.3, -0.2, 0.5}), SE3(SO3::rot_x(M_PI), {0.2, 0.1, 1.0}),
        SE3(SO3::rot_y(0.2), {0.0, 0.0, 0.4})}) {
    Scanner scanner;
    scanner.T_body_lidar = mounting;
    const DriveResult r = run(scanner, 0, false);
    const auto [t, a] = error(drive(0).inverse() * drive(59), r.T_first_last);
    EXPECT_LT(t, 0.02);
    EXPECT_LT(a, 0.005);
  }
}

TEST(ScanOdometry, ScannerOnItsSideSaysNothing) {
  Scanner scanner;
  scanner.T_body_lidar = SE3(SO3::rot_x(M_PI / 2), Eigen::Vector3d::Zero());
  const DriveResult r = run(scanner, 0, true, 5);
  EXPECT_EQ(r.last.status, ScanMotion::Status::kPredicted);
  const auto [t, a] = error(drive(0).inverse() * drive(4), r.T_first_last);
  EXPECT_LT(t + a, 1e-9);
}

TEST(ScanOdometry, CorridorIsDegenerateAlongAndTakesTheWheels) {
  ScanOdometry odometry;
  Scanner scanner;
  SE3 T;
  ScanMotion m;
  for (int i = 0; i < 20; ++i) {
    // Wheels claim 0.10 m a step and no turn; the truth drifts sideways.
    const SE3 truth = SE3::planar(0.1 * i, 0.01 * i, 0);
    std::optional<MotionGuess> g;
    if (i > 0) g = guess(SE3::planar(0.1, 0, 0), 0.02, 0.01);
    m = odometry.process(scanner.scan(corridor(), truth, 0.1 * i), g);
    T = T * m.T_prev_curr_body;
    if (i == 0) continue;
    EXPECT_EQ(m.status, ScanMotion::Status::kDegenerate);
    EXPECT_EQ(m.unknown_directions, 1);
    EXPECT_TRUE(m.left_to_wheels.way);
    EXPECT_FALSE(m.left_to_wheels.heading);
    EXPECT_GT(m.covariance(0, 0), 0.019 * 0.019);
    EXPECT_LT(m.covariance(1, 1), 0.005 * 0.005);
  }
  EXPECT_NEAR(T.translation().x(), 1.9, 0.02);
  EXPECT_NEAR(T.translation().y(), 0.19, 0.01);
  EXPECT_NEAR(T.so3().yaw(), 0, 0.005);
}

// Wheels leap in their heading between scans farther apart than before: the scan by itself tells
// the heading, but not how far the corridor went.
TEST(ScanOdometry, WayAlongACorridorStaysTheWheelsWhereTheScanOverrulesTheirHeading) {
  ScanOdometry odometry;
  Scanner scanner;
  SE3 T;
  for (int i = 0; i < 11; ++i) {
    const bool leap = i == 10;
    const double step = leap ? 0.3 : 0.1;
    std::optional<MotionGuess> g;
    if (i > 0) g = guess(SE3::planar(step, 0, leap ? 1 : 0), 0.01, 0.02);
    const SE3 truth = SE3::planar(leap ? 1.2 : 0.1 * i, 0, 0);
    T = T *
        odometry.process(scanner.scan(corridor(), truth, leap ? 1.2 : 0.1 * i), g).T_prev_curr_body;
  }
  EXPECT_NEAR(T.translation().x(), 1.2, 0.02);
  EXPECT_NEAR(T.so3().yaw(), 0, 0.01);
}

// The ground ahead of a scanner that tips at the end of a ramp: a wall across the hall, which runs
// away by 20 cm a scan.
TEST(ScanOdometry, WhatRunsAheadDoesNotMakeARobotLeap) {
  const auto driven = [](double most_acceleration) {
    ScanOdometryOptions options;
    options.limits.most_acceleration = most_acceleration;
    ScanOdometry odometry(options);
    Scanner scanner;
    SE3 T;
    for (int i = 0; i < 25; ++i) {
      const double ahead = 4 + 0.2 * std::max(0, i - 15);
      const std::vector<testing::Wall> walls{
          {{-200, -3}, {200, -3}}, {{-200, 3}, {200, 3}}, {{ahead, -3}, {ahead, 3}}};
      std::optional<MotionGuess> g;
      if (i > 0) g = guess(SE3::planar(0.1, 0, 0), 0.01, 0.01);
      const SE3 truth = SE3::planar(0.1 * i, 0, 0);
      T = T * odometry.process(scanner.scan(walls, truth, 0.1 * i), g).T_prev_curr_body;
    }
    return T.translation().x();
  };
  EXPECT_NEAR(driven(ScanOdometryOptions().limits.most_acceleration), 2.4, 0.05);
  EXPECT_LT(driven(1e9), 1);  // led by it
}

// In a door someone fills most of the view, and what is left of it fits elsewhere, turned by half a
// radian; intervals are uneven.
TEST(ScanOdometry, AMatchThatSpinsTheRobotAtOnceIsNotBelievedAgainstWheelsThatGoOn) {
  const auto turned = [](double least_spin) {
    ScanOdometryOptions options;
    options.limits.least_spin = least_spin;
    ScanOdometry odometry(options);
    Scanner scanner;
    SE3 T;
    double t = 0;
    for (int i = 0; i < 20; ++i) {
      t += i % 2 == 0 ? 0.1 : 0.14;
      std::optional<MotionGuess> g;
      if (i > 0) g = guess(SE3::planar(0.05, 0, 0), 0.01, 0.01);
      // The scan at 12 shows what it would had the robot spun, as the map does elsewhere.
      const SE3 truth = SE3::planar(-1 + 0.05 * i, 0, i >= 12 ? 0.5 : 0);
      T = T * odometry.process(scanner.scan(room(), truth, t), g).T_prev_curr_body;
    }
    return T.so3().yaw();
  };
  EXPECT_NEAR(turned(ScanOdometryOptions().limits.least_spin), 0, 0.1);
  EXPECT_NEAR(turned(1e9), 0.5, 0.1);
}

// How far scans say it went, of a robot that is stopped after twelve steps while its wheels go on.
double stopped_while_wheels_spin(const std::vector<testing::Wall>& walls, double from,
                                 double step) {
  ScanOdometry odometry;
  Scanner scanner;
  SE3 T;
  for (int i = 0; i < 25; ++i) {
    std::optional<MotionGuess> g;
    if (i > 0) g = guess(SE3::planar(step, 0, 0), 0.005, 0.005);
    const SE3 truth = SE3::planar(from + step * std::min(i, 12), 0, 0);
    T = T * odometry.process(scanner.scan(walls, truth, 0.1 * i), g).T_prev_curr_body;
  }
  return T.translation().x();
}

// Most of the scan shows it.
TEST(ScanOdometry, WheelsThatSpinAreOverruled) {
  EXPECT_NEAR(stopped_while_wheels_spin(room(), -1, 0.07), 0.84, 0.02);
}

// A twentieth of the scan shows it: the far end of a corridor.
TEST(ScanOdometry, WheelsThatSpinInACorridorAreOverruled) {
  const std::vector<testing::Wall> walls{
      {{-20, -1.2}, {7, -1.2}}, {{-20, 1.2}, {7, 1.2}}, {{7, -1.2}, {7, 1.2}}};
  EXPECT_NEAR(stopped_while_wheels_spin(walls, 0, 0.06), 0.72, 0.03);
}

// A robot that starts at once, with wheels that are not counted.
TEST(ScanOdometry, WheelsThatStandDoNotHoldARobotThatStarts) {
  for (const bool robust : {false, true}) {
    ScanOdometryOptions options;
    options.robust_wheels = robust;
    ScanOdometry odometry(options);
    Scanner scanner;
    SE3 T;
    for (int i = 0; i < 15; ++i) {
      std::optional<MotionGuess> g;
      if (i > 0) g = guess(SE3(), 0.002, 0.002);
      const SE3 truth = SE3::planar(-1 + 0.1 * std::max(0, i - 4), 0, 0);
      T = T * odometry.process(scanner.scan(room(), truth, 0.1 * i), g).T_prev_curr_body;
    }
    EXPECT_NEAR(T.translation().x(), 1, 0.03) << robust;
  }
}

TEST(ScanOdometry, EmptyScansAreBridgedByTheWheelsAndNeverNaN) {
  ScanOdometry odometry;
  Scanner scanner;
  SE3 T;
  for (int i = 0; i < 30; ++i) {
    LaserScan scan = scanner.scan(room(), drive(i), 0.1 * i);
    if (i % 10 == 5) scan.ranges.assign(scan.ranges.size(), 0.0F);
    if (i % 10 == 6) scan.ranges.assign(scan.ranges.size(), std::nanf(""));
    if (i % 10 == 7) scan.ranges.clear();
    std::optional<MotionGuess> g;
    if (i > 0) g = guess(drive(i - 1).inverse() * drive(i), 0.01, 0.01);
    const ScanMotion m = odometry.process(scan, g);
    T = T * m.T_prev_curr_body;
    EXPECT_TRUE(m.covariance.allFinite());
    if (i > 0) {
      EXPECT_GT(m.covariance.determinant(), 0);
    }
    if (i % 10 >= 5 && i % 10 <= 7) {
      EXPECT_EQ(m.status, ScanMotion::Status::kPredicted);
    }
  }
  const auto [t, a] = error(drive(0).inverse() * drive(29), T);
  EXPECT_LT(t, 0.03);
  EXPECT_LT(a, 0.01);
}

TEST(ScanOdometry, CovarianceIsNeitherBoastfulNorUseless) {
  // 40 fresh pairs of scans: the mean normalised squared error of three directions is 3 when the
  // covariance is right; the floor for shared errors makes it smaller.
  double sum = 0;
  for (int k = 0; k < 40; ++k) {
    Scanner scanner;
    scanner.rng.seed(static_cast<unsigned>(100 + k));
    ScanOdometry odometry;
    odometry.process(scanner.scan(room(), drive(k), 0));
    const SE3 truth = drive(k).inverse() * drive(k + 1);
    const ScanMotion m = odometry.process(scanner.scan(room(), drive(k + 1), 0.1));
    const PlanarPose d = planar_part(truth.inverse() * m.T_prev_curr_body);
    const Eigen::Vector3d e(d.x, d.y, d.yaw);
    sum += e.dot(planar_block(m.covariance).inverse() * e);
  }
  EXPECT_LT(sum / 40, 4.0);
  EXPECT_GT(sum / 40, 0.2);
}

// Ahead and back, a scan every 0.6 m: counters without a sign take the way back for a way ahead.
TEST(ScanOdometry, OverrulesWheelsThatCountBackwardsAsForwards) {
  Scanner scanner;
  scanner.beams = 181;
  scanner.fov = M_PI;
  const auto at = [](int i) {
    return SE3::planar(-2 + 0.6 * (i < 10 ? i : 18 - i), 0.5, 0.1 * (i % 3));
  };
  ScanOdometry odometry;
  SE3 T;
  int lost = 0;
  for (int i = 0; i < 18; ++i) {
    std::optional<MotionGuess> g;
    if (i > 0) {
      const SE3 d = at(i - 1).inverse() * at(i);
      g = guess(SE3::planar(std::abs(d.translation().x()), 0, d.so3().yaw()), 0.02, 0.03);
    }
    const ScanMotion m = odometry.process(scanner.scan(room(), at(i), i), g);
    T = T * m.T_prev_curr_body;
    lost += i > 0 && m.status != ScanMotion::Status::kTracked;
  }
  const auto [t, a] = error(at(0).inverse() * at(17), T);
  EXPECT_LT(t, 0.05);
  EXPECT_LT(a, 0.01);
  EXPECT_EQ(lost, 0);
}

// A turn that wheels have a quarter turn short: in a hall that is nearly square half of the scan
// fits there, too.
TEST(ScanOdometry, LooksFarWhereLessThanUsualFits) {
  const std::vector<testing::Wall> hall{{{-2.2, -3}, {2.2, -3}},
                                        {{2.2, -3}, {2.2, 3}},
                                        {{2.2, 3}, {-2.2, 3}},
                                        {{-2.2, 3}, {-2.2, -3}}};
  Scanner scanner;
  scanner.fov = 2 * M_PI;
  const auto at = [](int i) { return SE3::planar(0.05 * std::min(i, 10), 0, i > 10 ? 1.2 : 0); };
  ScanOdometry odometry;
  SE3 T;
  for (int i = 0; i < 12; ++i) {
    std::optional<MotionGuess> g;
    if (i > 0) {
      const SE3 d = at(i - 1).inverse() * at(i);
      const double turn = d.so3().yaw() - (i > 10 ? M_PI / 2 : 0);
      g = guess(SE3::planar(d.translation().x(), d.translation().y(), turn), 0.3, 0.03);
    }
    T = T * odometry.process(scanner.scan(hall, at(i), i), g).T_prev_curr_body;
  }
  const auto [t, a] = error(at(0).inverse() * at(11), T);
  EXPECT_LT(t, 0.05);
  EXPECT_LT(a, 0.01);
}

// From a turn on the spot into a corridor, half a metre between scans and no wheels: a match that
// stays behind fits two thirds of the scan, as the walls are the same all along.
TEST(ScanOdometry, WithoutWheelsLooksAroundWhereLessThanUsualFits) {
  Scanner scanner;
  scanner.beams = 361;
  scanner.fov = M_PI;
  const auto at = [](int i) {
    return SE3::planar(0.5 * std::max(0, i - 10), 0.1, 0.42 * (std::min(i, 10) - 10));
  };
  ScanOdometry odometry;
  SE3 T;
  for (int i = 0; i < 16; ++i) {
    const ScanMotion m = odometry.process(scanner.scan(testing::niches(), at(i), 0.7 * i));
    T = T * m.T_prev_curr_body;
  }
  const auto [t, a] = error(at(0).inverse() * at(15), T);
  EXPECT_LT(t, 0.1);
  EXPECT_LT(a, 0.01);
}

// What wheels are compared with must not be what they had a say in: four steps on one key scan.
TEST(ScanOdometry, ScansAloneAreNotPulledByTheWheels) {
  double fused = 0, alone = 0;
  constexpr int kRuns = 20;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    Scanner scanner;
    scanner.rng.seed(seed);
    scanner.sigma = 0.03;
    scanner.beams = 181;
    ScanOdometry odometry;
    for (int i = 0; i < 6; ++i) {
      // Wheels sure of themselves, and short by a tenth: not enough to be doubted so soon.
      std::optional<MotionGuess> g;
      if (i > 0) g = guess(SE3::planar(0.045, 0, 0), 0.003, 0.003);
      const SE3 pose = SE3::planar(-2 + 0.05 * i, 0.5, 0);
      const ScanMotion m = odometry.process(scanner.scan(room(), pose, 0.1 * i), g);
      EXPECT_EQ(m.by_scans_alone.has_value(), i >= 2);
      if (i < 2) continue;
      fused += m.T_prev_curr_body.translation().x() / (4 * kRuns);
      alone += m.by_scans_alone->translation().x() / (4 * kRuns);
    }
  }
  EXPECT_LT(fused, 0.047);
  EXPECT_NEAR(alone, 0.05, 0.0025);
}

TEST(ScanOdometry, SameInputSameBytes) {
  const SE3 a = run(Scanner{}, 0.1, true, 20).T_first_last;
  const SE3 b = run(Scanner{}, 0.1, true, 20).T_first_last;
  EXPECT_EQ(a.translation(), b.translation());
  EXPECT_EQ(a.so3().quaternion().coeffs(), b.so3().quaternion().coeffs());
}

}  // namespace
}  // namespace lamina
