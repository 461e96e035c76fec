// Scans of a room with a floor by a scanner that leans, by ray casting.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>

#include <lamina/sensors/laser_scan.hpp>

namespace lamina::testing {

constexpr double kDegree = M_PI / 180;

// A room of 12 x 8 m whose middle is the origin; `truth`: the scanner in the body.
inline LaserScan leaning_scan(const SE3& T_world_body, const SE3& truth, const SE3& stated,
                              std::mt19937& rng) {
  std::normal_distribution<double> noise(0, 0.01);
  const SE3 T_world_lidar = T_world_body * truth;
  const Eigen::Vector3d o = T_world_lidar.translation();
  LaserScan s;
  s.angle_min = -M_PI;
  s.angle_increment = 2 * kDegree;
  s.range_max = 30;
  s.lidar.T_body_lidar = stated;
  for (int i = 0; i < 180; ++i) {
    const double a = s.angle(static_cast<std::size_t>(i));
    const Eigen::Vector3d d = T_world_lidar.so3() * Eigen::Vector3d(std::cos(a), std::sin(a), 0);
    double range = 1e9;
    const auto wall = [&range](double distance, double speed) {
      if (speed > 1e-9) range = std::min(range, distance / speed);
    };
    wall(6 - o.x(), d.x());
    wall(6 + o.x(), -d.x());
    wall(4 - o.y(), d.y());
    wall(4 + o.y(), -d.y());
    wall(o.z(), -d.z());
    s.ranges.push_back(static_cast<float>(range + noise(rng)));
  }
  return s;
}

inline SE3 mounted(double height, double pitch, double roll = 0) {
  return SE3(SO3::exp({0, pitch, 0}) * SO3::exp({roll, 0, 0}), {0.1, 0, height});
}

}  // namespace lamina::testing
