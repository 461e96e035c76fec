// A depth camera among planes, drawn ray by ray.
#pragma once

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include <lamina/sensors/depth_frame.hpp>

namespace lamina::made_up {

/// n.x = rho in the world, seen from its positive side; the nearest along a ray counts.
using Planes = std::vector<std::pair<Eigen::Vector3d, double>>;

inline Planes room() {
  const Eigen::Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  return {{z, 0},    {-x, -2.2}, {y, -1.5}, {-y, -2}, {Eigen::Vector3d(-0.6, -0.8, 0), -2.0},
          {-z, -2.4}};
}
/// A floor and two walls that run on for ever.
inline Planes corridor() { return {{{0, 0, 1}, 0}, {{0, 1, 0}, -1}, {{0, -1, 0}, -1}}; }

struct Camera {
  double sigma_scale = 0.3;  ///< a coarse camera averages what a fine one would see
  double bend = 0;           ///< px of disparity at the sides of the image, as the square of u
  double waves = 0;          ///< px of disparity, three waves across the image
  std::mt19937 rng{11};

  DepthFrame see(const Planes& planes, const SE3& T_world_body, double t) {
    DepthFrame f;
    f.stamp = Timestamp::from_seconds(t);
    CameraModel& c = f.camera.camera;
    c.width = 160;
    c.height = 120;
    c.fx = c.fy = 140;
    c.cx = 79.5;
    c.cy = 59.5;
    c.T_body_camera = SE3(SO3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)), {0.1, 0.05, 1.0});
    f.camera.depth_scale = 5000;
    f.camera.noise = DepthNoise::kinect(570);
    f.raw.assign(static_cast<std::size_t>(c.width * c.height), 0);
    std::normal_distribution<double> noise(0, sigma_scale);
    const SE3 T = T_world_body * c.T_body_camera;
    for (int v = 0; v < c.height; ++v) {
      for (int u = 0; u < c.width; ++u) {
        const Eigen::Vector3d ray =
            T.so3() * Eigen::Vector3d((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1);
        double z = 1e9;
        for (const auto& [n, rho] : planes) {
          const double d = (rho - n.dot(T.translation())) / n.dot(ray);
          if (d > 0.1 && d < z) z = d;
        }
        z += f.camera.noise.sigma_depth(z) * noise(rng);
        const double x = u / c.cx - 1, y = v / c.cy - 1;
        const double off = bend * x * x + waves * std::sin(3 * M_PI * x) * std::cos(2 * M_PI * y);
        z = f.camera.noise.disparity(1) / (f.camera.noise.disparity(z) + off);
        if (z < 9)
          f.raw[static_cast<std::size_t>(v * c.width + u)] =
              static_cast<std::uint16_t>(z * 5000 + 0.5);
      }
    }
    return f;
  }
};

}  // namespace lamina::made_up
