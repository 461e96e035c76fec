// Scans that fit nowhere, or elsewhere, while wheels go on; and what one wall leaves open.
#include <gtest/gtest.h>

#include <lamina/frontend/odometry/scan_odometry.hpp>

#include "planar_world.hpp"

namespace lamina {
namespace {

using testing::drive;
using testing::guess;
using testing::room;
using testing::Scanner;

// Scans 0.6 s apart: any acceleration would allow it.
TEST(ScanOdometry, BetweenSlowScansNoRobotSpinsThatWheelsDriveStraight) {
  const auto turned = [](double pivot) {
    ScanOdometryOptions options;
    options.pivot = pivot;
    options.most_spin = 1e9;
    ScanOdometry odometry(options);
    Scanner scanner;
    SE3 T;
    for (int i = 0; i < 16; ++i) {
      std::optional<MotionGuess> g;
      if (i > 0) g = guess(SE3::planar(0.05, 0, 0), 0.01, 0.01);
      const SE3 truth = SE3::planar(-1 + 0.05 * i, 0, i >= 12 ? 0.5 : 0);
      T = T * odometry.process(scanner.scan(room(), truth, 0.6 * i), g).T_prev_curr_body;
    }
    return T.so3().yaw();
  };
  EXPECT_NEAR(turned(ScanOdometryOptions().pivot), 0, 0.1);
  EXPECT_NEAR(turned(1e-3), 0.5, 0.1);
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
