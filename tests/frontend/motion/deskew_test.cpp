// Scans of a moving scanner against what it would have measured standing still.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/frontend/motion/deskew.hpp>

namespace lamina {
namespace {

// The range from a scanner at T_room_lidar along `angle` to the walls of a room 8 x 6 m about the
// origin.
double range_in_room(const SE3& T_room_lidar, double angle) {
  const Eigen::Vector3d ray =
      T_room_lidar.so3() * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
  const Eigen::Vector3d& at = T_room_lidar.translation();
  const double x = ((ray.x() > 0 ? 4 : -4) - at.x()) / ray.x();
  const double y = ((ray.y() > 0 ? 3 : -3) - at.y()) / ray.y();
  return std::min(x, y);
}

struct Sweep {
  double beam_time = 0;
  Vector6d velocity = Vector6d::Zero();
  double from = -2.3, increment = 0.01;
  SE3 T_body_lidar = SE3::planar(0.2, -0.1, 0.4);

  LaserScan scan() const {
    LaserScan s;
    s.angle_min = from;
    s.angle_increment = increment;
    s.range_max = 20;
    s.lidar.noise.range_sigma = 0.01;
    s.lidar.T_body_lidar = T_body_lidar;
    for (int i = 0; i < 461; ++i) {
      const SE3 T_room_body = SE3::planar(0.3, 0.2, 0.1) * SE3::exp(i * beam_time * velocity);
      s.ranges.push_back(
          static_cast<float>(range_in_room(T_room_body * T_body_lidar, s.angle(s.size()))));
    }
    return s;
  }
};

// The largest distance of a return from the walls, and of a range from that of a still scanner.
double worst_misfit(const LaserScan& scan) {
  const SE3 T_room_lidar = SE3::planar(0.3, 0.2, 0.1) * scan.lidar.T_body_lidar;
  double worst = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Eigen::Vector2d p = scan.point(i);
    const Eigen::Vector3d room = T_room_lidar * Eigen::Vector3d(p.x(), p.y(), 0);
    worst = std::max(worst, std::abs(std::min(4 - std::abs(room.x()), 3 - std::abs(room.y()))));
  }
  return worst;
}

TEST(Sweep, ATurningAndDrivingScannersReturnsComeBackToTheWalls) {
  for (const double increment : {0.01, -0.01}) {
    Sweep sweep;
    sweep.from = increment > 0 ? -2.3 : 2.3;
    sweep.increment = increment;
    sweep.beam_time = 0.075 / 460;
    sweep.velocity << 0.7, 0, 0, 0, 0, 2;
    const LaserScan measured = sweep.scan();
    EXPECT_GT(worst_misfit(measured), 0.2);
    const LaserScan still = straightened(measured, sweep.beam_time, sweep.velocity);
    EXPECT_LT(worst_misfit(still), 1e-5);
    ASSERT_EQ(still.angles.size(), still.size());
    for (std::size_t i = 1; i < still.size(); ++i) {
      EXPECT_GT((still.angle(i) - still.angle(i - 1)) * increment, 0) << i;
    }
  }
}

TEST(Sweep, AFullTurnStaysOne) {
  Sweep sweep;
  sweep.T_body_lidar = SE3();
  sweep.from = 0;
  sweep.increment = 2 * M_PI / 461;
  sweep.beam_time = 1e-4;
  sweep.velocity << 0, 0, 0, 0, 0, -1;
  const LaserScan still = straightened(sweep.scan(), sweep.beam_time, sweep.velocity);
  EXPECT_LT(worst_misfit(still), 1e-5);
  EXPECT_NEAR(still.angle(460), 460 * sweep.increment - 460 * sweep.beam_time, 1e-5);
}

TEST(Sweep, AScannerThatHardlyMovedIsLeftAlone) {
  Sweep sweep;
  sweep.beam_time = 1e-4;
  const LaserScan still = straightened(sweep.scan(), sweep.beam_time, Vector6d::Zero());
  EXPECT_TRUE(still.angles.empty());
  EXPECT_EQ(still.ranges, sweep.scan().ranges);
  const LaserScan at_once = straightened(sweep.scan(), 0, Vector6d::Ones());
  EXPECT_TRUE(at_once.angles.empty());
}

TEST(Sweep, BeamsWithoutReturnTurnAlongAndStayWithout) {
  Sweep sweep;
  sweep.beam_time = 1e-4;
  sweep.velocity << 0, 0, 0, 0, 0, 1;
  LaserScan measured = sweep.scan();
  measured.ranges[100] = 0;
  const LaserScan still = straightened(measured, sweep.beam_time, sweep.velocity);
  EXPECT_FALSE(still.valid(100));
  EXPECT_NEAR(still.angle(100), measured.angle(100) + 100 * sweep.beam_time, 1e-6);
}

}  // namespace
}  // namespace lamina
