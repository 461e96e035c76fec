// Literal scenes for the floor's tests: a few planes drawn into a depth image, exactly.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include <lamina/models/plane.hpp>
#include <lamina/sensors/depth_frame.hpp>

namespace lamina::testing {

/// A camera 0.8 m above the floor, looking forward and `pitch` rad down.
inline DepthCamera test_camera(double pitch = 0.45, double height = 0.8) {
  DepthCamera c;
  c.camera = {640, 480, 525, 525, 319.5, 239.5, {}, SE3()};
  const SO3 optical = SO3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5));
  c.camera.T_body_camera = SE3(SO3::rot_y(pitch) * optical, {0, 0, height});
  c.depth_scale = 5000;
  c.noise = DepthNoise::kinect(525);
  return c;
}

/// The same with a quarter of the pixels to each side: quicker.
inline DepthCamera small_test_camera(double pitch) {
  DepthCamera c = test_camera(pitch);
  const SE3 T_body_camera = c.camera.T_body_camera;
  c.camera = {160, 120, 131, 131, 79.5, 59.5, {}, T_body_camera};
  return c;
}

/// A plane piece: the plane in the body frame and where on it there is matter.
struct Piece {
  Plane plane_body;
  std::function<bool(const Eigen::Vector3d&)> inside = [](const Eigen::Vector3d&) { return true; };
};

/// Nearest pieces, with white disparity noise of `sigma_px` (0: exact, but for quantised depth).
inline DepthFrame draw(const std::vector<Piece>& pieces, const DepthCamera& camera,
                       double sigma_px = 0, std::uint64_t seed = 1) {
  DepthFrame frame;
  frame.camera = camera;
  const CameraModel& c = camera.camera;
  frame.raw.assign(static_cast<std::size_t>(c.width * c.height), 0);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1);
  const SE3& T = c.T_body_camera;
  for (int v = 0; v < c.height; ++v) {
    for (int u = 0; u < c.width; ++u) {
      const Eigen::Vector3d ray =
          T.so3() * Eigen::Vector3d((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1);
      double nearest = std::numeric_limits<double>::infinity();
      for (const Piece& piece : pieces) {
        const double slope = piece.plane_body.normal().dot(ray);
        const double z = -piece.plane_body.signed_distance(T.translation()) / slope;
        if (z > 0.05 && z < nearest && piece.inside(T.translation() + z * ray)) nearest = z;
      }
      const double noise = sigma_px > 0 ? sigma_px * normal(random) : 0;
      const double d = camera.noise.focal_baseline / nearest + noise;
      const double raw = d > 0 ? camera.noise.focal_baseline / d * camera.depth_scale : 0;
      if (raw >= 1 && raw < 65535) {
        frame.raw[static_cast<std::size_t>(v * c.width + u)] =
            static_cast<std::uint16_t>(raw + 0.5);
      }
    }
  }
  return frame;
}

inline Piece floor_piece() { return {Plane({0, 0, 1}, 0)}; }
inline Piece wall_piece(double x) { return {Plane({-1, 0, 0}, -x)}; }
/// A level square at height z.
inline Piece square_piece(double x, double y, double half, double z) {
  return {Plane({0, 0, 1}, z), [=](const Eigen::Vector3d& p) {
            return std::abs(p.x() - x) < half && std::abs(p.y() - y) < half;
          }};
}

}  // namespace lamina::testing
