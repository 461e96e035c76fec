// Exact depth images of a level floor with a pit, drawn ray by ray.
#pragma once

#include <cmath>
#include <functional>

#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/sensors/depth_frame.hpp>

namespace lamina {

/// Camera 0.8 m above the floor, pitched down (rad), 320 x 240.
inline DepthFrame empty_frame(double pitch = 0.35, double height = 0.8) {
  DepthFrame f;
  CameraModel& c = f.camera.camera;
  c.width = 320;
  c.height = 240;
  c.fx = c.fy = 260;
  c.cx = 159.5;
  c.cy = 119.5;
  c.T_body_camera = SE3(SO3::rot_y(pitch) * forward_looking_camera().so3(), {0, 0, height});
  f.camera.noise = DepthNoise::kinect(260);
  f.camera.depth_scale = 5000;
  f.raw.assign(320 * 240, 0);
  return f;
}

/// Sets each pixel to the depth `hit` gives for its ray (origin, direction per metre of depth; body
/// frame); 0: no measurement.
inline void draw(DepthFrame& f,
                 const std::function<double(const Eigen::Vector3d&, const Eigen::Vector3d&)>& hit) {
  const CameraModel& c = f.camera.camera;
  for (int v = 0; v < c.height; ++v) {
    for (int u = 0; u < c.width; ++u) {
      const Eigen::Vector3d ray =
          c.T_body_camera.so3() * Eigen::Vector3d((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1);
      const double z = hit(c.T_body_camera.translation(), ray);
      f.raw[static_cast<std::size_t>(v * c.width + u)] =
          z > 0 && z < 10 ? static_cast<std::uint16_t>(std::lround(z * f.camera.depth_scale)) : 0;
    }
  }
}

/// Depth at which a ray meets the level plane z, or 0.
inline double level(const Eigen::Vector3d& o, const Eigen::Vector3d& d, double z) {
  return d.z() < -1e-6 ? (z - o.z()) / d.z() : 0;
}

/// Floor with a pit over x in [from, to], |y| < 1: its bottom `depth` below; 0: nothing returns.
inline void draw_pit(DepthFrame& f, double from, double to, double depth) {
  draw(f, [&](const Eigen::Vector3d& o, const Eigen::Vector3d& d) -> double {
    const double z = level(o, d, 0);
    const Eigen::Vector3d p = o + d * z;
    if (z <= 0 || p.x() < from || p.x() > to || std::abs(p.y()) > 1) return z;
    if (depth <= 0) return 0;
    const double wall = (to - o.x()) / d.x();  // the pit's far side
    return std::min(wall, level(o, d, -depth));
  });
}

}  // namespace lamina
