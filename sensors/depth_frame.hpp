// A depth image as the sensor gave it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include <lamina/models/timestamp.hpp>
#include <lamina/sensors/calibration.hpp>

namespace lamina {

/// Raw 16-bit depth, row-major, 0 = no measurement; metres and disparity on demand. `camera` is
/// undistorted geometry: readers of distorted cameras rectify before they hand out a frame.
struct DepthFrame {
  Timestamp stamp;
  DepthCamera camera;
  std::vector<std::uint16_t> raw;  ///< width * height

  int width() const { return camera.camera.width; }
  int height() const { return camera.camera.height; }
  std::uint16_t raw_at(int u, int v) const {
    return raw[static_cast<std::size_t>(v) * static_cast<std::size_t>(width()) +
               static_cast<std::size_t>(u)];
  }
  /// Depth along the optical axis in metres; 0 where there is no measurement.
  double depth_m(int u, int v) const { return raw_at(u, v) / camera.depth_scale; }
  /// f b / Z in pixels; 0 where there is no measurement.
  double disparity(int u, int v) const {
    const double z = depth_m(u, v);
    return z > 0 ? camera.noise.disparity(z) : 0;
  }
  /// Camera-frame point of a pixel with a measurement (m).
  Eigen::Vector3d point_camera(int u, int v) const {
    const double z = depth_m(u, v);
    const CameraModel& c = camera.camera;
    return {(u - c.cx) * z / c.fx, (v - c.cy) * z / c.fy, z};
  }
};

}  // namespace lamina
