// A robot on ground that swells: where it stands, what it sees of the floor, how its wheels err.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include <lamina/backend/graph/graph.hpp>
#include <lamina/models/moments.hpp>

namespace lamina::test {

inline double swell(double x, double y) {
  return 0.012 * std::sin(2.9 * x + 0.7 * y) + 0.01 * std::sin(1.1 * x - 2.3 * y + 1);
}

/// The body on the ground at (x, y), tilted as that is.
inline SE3 on_ground(double x, double y, double yaw) {
  const double e = 0.2;
  const Eigen::Vector3d n = Eigen::Vector3d((swell(x - e, y) - swell(x + e, y)) / (2 * e),
                                            (swell(x, y - e) - swell(x, y + e)) / (2 * e), 1)
                                .normalized();
  const SO3 tilt{Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), n)};
  return SE3(tilt * SO3::rot_z(yaw), {x, y, swell(x, y)});
}

/// Patches of 0.2 m of the ground ahead, 2.4 x 1.8 m of it, in the body frame, to `noise` m a
/// point.
inline std::vector<Moments> patches_ahead(const SE3& T_map_body, double noise, std::mt19937& rng) {
  std::normal_distribution<double> normal(0, noise);
  std::vector<Moments> patches;
  const SE3 T_body_map = T_map_body.inverse();
  for (double x = 0.6; x < 3; x += 0.3) {
    for (double y = -0.9; y < 0.9; y += 0.3) {
      Moments m;
      for (int k = 0; k < 9; ++k) {
        Eigen::Vector3d p = T_map_body * Eigen::Vector3d(x + 0.06 * (k % 3), y + 0.06 * (k / 3), 0);
        p.z() = swell(p.x(), p.y()) + normal(rng);
        m.add(T_body_map * p, 1 / (noise * noise));
      }
      patches.push_back(m);
    }
  }
  return patches;
}

/// A level floor at z = 0 that was seen from (-5, -5) to (10, 5).
inline PlaneLandmark seen_floor() {
  PlaneLandmark floor = PlaneLandmark::at(Plane(Eigen::Vector3d::UnitZ(), 0), {0, 0, 0});
  floor.outline = OutlineGrid(0.1);
  for (int i = -50; i < 100; ++i) {
    for (int j = -50; j < 50; ++j) {
      const Eigen::Vector3d p(0.1 * i + 0.05, 0.1 * j + 0.05, 0);
      floor.outline.add((floor.T_map_outline.inverse() * p).head<2>());
    }
  }
  floor.votes.floor = 10;
  return floor;
}

}  // namespace lamina::test
