// Scans that fit nowhere, or elsewhere, while wheels go on; and what one wall leaves open.
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include <lamina/frontend/motion/scan_odometry.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

using testing::drive;
using testing::guess;
using testing::room;
using testing::Scanner;

// Of a robot in the middle of a room whose wheels say that it creeps straight on: where it ends,
// when from step 12 on `seen` is what its scanner shows it.
SE3 after(double dt, double turned, Scanner scanner, const std::function<void(LaserScan&)>& spoil) {
  ScanOdometry odometry;
  SE3 T;
  for (int i = 0; i < 14; ++i) {
    std::optional<MotionGuess> g;
    if (i > 0) g = guess(SE3::planar(0.01, 0, 0), 0.01, 0.01);
    const SE3 truth = SE3::planar(-1 + 0.01 * i, 0, i >= 12 ? turned : 0);
    LaserScan scan = scanner.scan(room(), truth, dt * i);
    if (i >= 12) spoil(scan);
    T = T * odometry.process(scan, g).T_prev_curr_body;
  }
  return T;
}

// Somebody turns the robot by hand.
TEST(ScanOdometry, ATurnThatWheelsMissIsTheScansWhereTheseFit) {
  for (const double dt : {0.2, 0.6}) {
    EXPECT_NEAR(after(dt, 0.18, {}, [](LaserScan&) {}).so3().yaw(), 0.18, 0.01) << dt;
  }
}

// The robot tips: most of what it sees is elsewhere each time.
TEST(ScanOdometry, AScanThatFitsNowhereMuchBetterIsLeftToTheWheels) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<float> anywhere(0.4F, 3.0F);
  const auto spoil = [&](LaserScan& scan) {
    for (std::size_t i = 0; i < scan.size(); ++i) {
      if (i / 9 % 10 < 6) scan.ranges[i] = i % 9 == 0 ? anywhere(rng) : scan.ranges[i - 1];
    }
  };
  Scanner coarse;
  coarse.beams = 91;
  coarse.sigma = 0.05;
  EXPECT_NEAR(after(0.6, 0.25, coarse, spoil).so3().yaw(), 0, 0.05);
}

// A scanner that tips meets the floor all round, for two scans.
TEST(ScanOdometry, ScansThatFitNowhereWhileWheelsGoOnLeaveTheMapAsItIs) {
  ScanOdometry odometry;
  Scanner scanner;
  const auto ring = [](const SE3& T) {
    std::vector<testing::Wall> walls;
    for (int k = 0; k < 8; ++k) {
      const auto corner = [&](int j) {
        const Eigen::Vector3d at(0.7 * std::cos(j * M_PI / 4), 0.7 * std::sin(j * M_PI / 4), 0);
        return Eigen::Vector2d((T * at).head<2>());
      };
      walls.push_back({corner(k), corner(k + 1)});
    }
    return walls;
  };
  SE3 T;
  for (int i = 0; i < 20; ++i) {
    const SE3 truth = drive(i);
    std::optional<MotionGuess> g;
    if (i > 0) g = guess(drive(i - 1).inverse() * truth, 0.01, 0.01);
    const bool tipped = i == 10 || i == 11;
    const ScanMotion motion =
        odometry.process(scanner.scan(tipped ? ring(truth) : room(), truth, 0.1 * i), g);
    T = T * motion.T_prev_curr_body;
    if (tipped) {
      EXPECT_TRUE(motion.wheels_went_on) << i;
      EXPECT_EQ(motion.iterations, 0) << i;
    } else if (i > 0) {
      EXPECT_EQ(motion.status, ScanMotion::Status::kTracked) << i;
    }
  }
  const SE3 off = drive(19).inverse() * drive(0) * T;
  EXPECT_LT(off.translation().norm(), 0.02);
  EXPECT_LT(off.so3().log().norm(), 0.01);
}

// A driver that sends its last scan again and again.
TEST(ScanOdometry, AScanThatRepeatsItselfWhileWheelsDriveTellsNothing) {
  ScanOdometry odometry;
  Scanner scanner;
  LaserScan scan;
  SE3 T;
  int stale = 0;
  for (int i = 0; i < 20; ++i) {
    std::optional<MotionGuess> g;
    if (i > 0) g = guess(drive(i - 1).inverse() * drive(i), 0.005, 0.005);
    if (i < 8 || i > 13) scan = scanner.scan(room(), drive(i), 0.1 * i);
    scan.stamp = Timestamp::from_seconds(0.1 * i);
    const ScanMotion motion = odometry.process(scan, g);
    T = T * motion.T_prev_curr_body;
    stale += motion.wheels_went_on && motion.iterations == 0;
  }
  EXPECT_EQ(stale, 6);
  EXPECT_LT((drive(19).inverse() * drive(0) * T).translation().norm(), 0.02);
}

// What normals along one wall scatter by is no measurement of the way along it.
TEST(ScanOdometry, AloneAlongOneWallTheWayIsOpen) {
  const std::vector<testing::Wall> wall{{{-50, 2}, {50, 2}}};
  ScanOdometry odometry;
  Scanner scanner;
  scanner.sigma = 0.03;
  ScanMotion last;
  for (int i = 0; i < 10; ++i)
    last = odometry.process(scanner.scan(wall, SE3::planar(0.05 * i, 0, 0), 0.1 * i));
  EXPECT_EQ(last.unknown_directions, 1);
}

}  // namespace
}  // namespace lamina
