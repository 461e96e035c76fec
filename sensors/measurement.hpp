// What sensors measure: value types, one variant.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include <lamina/sensors/depth_frame.hpp>
#include <lamina/sensors/laser_scan.hpp>
#include <lamina/sensors/odometry.hpp>
#include <lamina/sensors/stereo_frame.hpp>

namespace lamina {

/// A point cloud that is no depth image. Organised when height > 1 (row-major, NaN = no return).
struct CloudFrame {
  Timestamp stamp;
  int width = 0, height = 1;
  std::vector<Eigen::Vector3f> points_sensor;  ///< m
  SE3 T_body_sensor;
};

struct Accelerometer {
  Timestamp stamp;
  Eigen::Vector3d acceleration_body = Eigen::Vector3d::Zero();  ///< m/s^2; at rest (0, 0, +9.81)
};

using Measurement =
    std::variant<DepthFrame, StereoFrame, LaserScan, Odometry, CloudFrame, Accelerometer>;

inline Timestamp stamp_of(const Measurement& m) {
  return std::visit([](const auto& value) { return value.stamp; }, m);
}

}  // namespace lamina
