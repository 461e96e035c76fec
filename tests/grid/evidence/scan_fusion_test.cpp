// Depth and lidar joined in the body frame.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/grid/evidence/scan_fusion.hpp>

namespace lamina {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

LaserScan scan(double t, double from, double increment, std::size_t beams, float range) {
  LaserScan s;
  s.stamp = Timestamp::from_seconds(t);
  s.angle_min = from;
  s.angle_increment = increment;
  s.range_max = 20;
  s.ranges.assign(beams, range);
  return s;
}

float ahead(const LaserScan& s, double angle = 0) {
  const double k = std::remainder(angle - s.angle_min, 2 * M_PI);
  const auto i =
      static_cast<std::size_t>(std::lround((k < -1e-9 ? k + 2 * M_PI : k) / s.angle_increment));
  return i < s.size() ? s.ranges[i] : kNaN;
}

TEST(CombinedScan, ALidarAloneInTheBodysPlaceStaysAsItIs) {
  CombinedScan combined;
  const LaserScan in = scan(1, -1, 0.01, 200, 5);
  const LaserScan out = combined.add(in, CombinedScan::Kind::kLidar, SE3());
  EXPECT_EQ(out.ranges, in.ranges);
  EXPECT_EQ(out.angle_min, in.angle_min);
}

TEST(CombinedScan, ALidarElsewhereIsBroughtToTheBody) {
  CombinedScan combined;
  LaserScan in = scan(1, -0.2, 0.01, 41, 5);
  in.lidar.T_body_lidar = SE3(SO3::rot_z(M_PI / 2), {0.3, 0, 0.2});
  const LaserScan out = combined.add(in, CombinedScan::Kind::kLidar, SE3());
  EXPECT_NEAR(ahead(out, std::atan2(5.0, 0.3)), std::hypot(5.0, 0.3), 0.02);
  EXPECT_TRUE(std::isnan(ahead(out, -1)));
  EXPECT_EQ(out.lidar.T_body_lidar.translation().norm(), 0);
}

TEST(CombinedScan, TheNearerOfBothCountsMovedByTheRobot) {
  CombinedScan combined;
  // A pit 3 m ahead in depth, a wall 5 m ahead in the scan 0.2 s and 0.5 m later.
  combined.add(scan(1.0, -0.1, 0.002, 101, 3), CombinedScan::Kind::kDepth, SE3());
  const LaserScan out = combined.add(scan(1.2, -1, 0.01, 201, 5), CombinedScan::Kind::kLidar,
                                     SE3::from_translation({0.5, 0, 0}));
  EXPECT_NEAR(ahead(out), 2.5, 0.01);
  EXPECT_NEAR(ahead(out, 0.8), 5, 0.01);
  // Long after, depth says nothing any more.
  const LaserScan later =
      combined.add(scan(3, -1, 0.01, 201, 5), CombinedScan::Kind::kLidar, SE3());
  EXPECT_NEAR(ahead(later), 5, 0.01);
}

}  // namespace
}  // namespace lamina
