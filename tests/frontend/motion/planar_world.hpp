// A small flat world of vertical walls, and a scanner in it, for tests of scan matching.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include <lamina/frontend/motion/scan_odometry.hpp>
#include <lamina/models/lie/se3.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina::testing {

struct Wall {
  Eigen::Vector2d a, b;
};

/// 8 x 6 m room with a pillar and a niche: nothing in it is symmetric.
inline std::vector<Wall> room() {
  return {{{-3, -2}, {5, -2}},      {{5, -2}, {5, 1}},        {{5, 1}, {4, 1}},
          {{4, 1}, {4, 4}},         {{4, 4}, {-3, 4}},        {{-3, 4}, {-3, -2}},
          {{1.0, 1.5}, {1.5, 1.5}}, {{1.5, 1.5}, {1.5, 2.2}}, {{1.5, 2.2}, {1.0, 2.2}},
          {{1.0, 2.2}, {1.0, 1.5}}};
}

/// Two bare walls, 2.4 m apart, 400 m long.
inline std::vector<Wall> corridor() {
  return {{{-200, -1.2}, {200, -1.2}}, {{-200, 1.2}, {200, 1.2}}};
}

/// Two walls with niches of 15 cm, one every 4 m on either side.
inline std::vector<Wall> niches() {
  std::vector<Wall> walls;
  for (const double side : {-1.0, 1.0}) {
    for (int k = -10; k < 10; ++k) {
      const double x = 4 * k + side, y = 1.1 * side, back = 1.25 * side;
      walls.push_back({{x, y}, {x + 3.1, y}});
      walls.push_back({{x + 3.1, y}, {x + 3.1, back}});
      walls.push_back({{x + 3.1, back}, {x + 4, back}});
      walls.push_back({{x + 4, back}, {x + 4, y}});
    }
  }
  return walls;
}

/// A bent drive through room(): pose at step i.
inline SE3 drive(int i) {
  const double s = 0.05 * i;
  return SE3::planar(-1.5 + 0.9 * s, 0.4 * std::sin(s), 0.6 * std::sin(0.9 * s));
}

/// What wheels say of a motion in the plane (1-sigma, m and rad).
inline MotionGuess guess(const SE3& T, double sigma_t, double sigma_r) {
  MotionGuess g{T, Matrix6d::Identity() * 1e-6};
  g.covariance(0, 0) = g.covariance(1, 1) = sigma_t * sigma_t;
  g.covariance(5, 5) = sigma_r * sigma_r;
  return g;
}

struct Scanner {
  int beams = 361;
  double fov = 1.5 * M_PI;
  double range_max = 20;
  double sigma = 0.01;
  SE3 T_body_lidar;
  std::mt19937 rng{7};

  LaserScan scan(const std::vector<Wall>& walls, const SE3& T_world_body, double t) {
    LaserScan s;
    s.stamp = Timestamp::from_seconds(t);
    s.angle_min = -fov / 2;
    s.angle_increment = fov / (beams - 1);
    s.range_max = range_max;
    s.lidar.T_body_lidar = T_body_lidar;
    s.lidar.noise.range_sigma = std::max(sigma, 0.001);
    const SE3 T = T_world_body * T_body_lidar;
    std::normal_distribution<double> noise(0, 1);
    for (int i = 0; i < beams; ++i) {
      const double angle = s.angle(static_cast<std::size_t>(i));
      const Eigen::Vector3d d = T.so3() * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
      double best = 0;
      for (const Wall& w : walls) {
        const Eigen::Vector2d e = w.b - w.a, o = w.a - T.translation().head<2>();
        const double det = e.x() * d.y() - e.y() * d.x();
        if (std::abs(det) < 1e-12) continue;
        const double range = (e.x() * o.y() - e.y() * o.x()) / det;
        const double along = (d.x() * o.y() - d.y() * o.x()) / det;
        if (range > 0.02 && along >= 0 && along <= 1 && (best == 0 || range < best)) best = range;
      }
      const double r = best > 0 ? best + sigma * noise(rng) : 0;
      s.ranges.push_back(static_cast<float>(r < range_max ? r : 0));
    }
    return s;
  }
};

}  // namespace lamina::testing
