// What is wrong with a depth camera in every image: told by a map that was made with it.
#pragma once

#include <optional>

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/parameters/wheel_errors.hpp>
#include <lamina/models/depth_camera_error.hpp>

namespace lamina {

/// Errors of a robot whose planes one depth camera sees and whose motions wheels tell.
struct DepthErrors {
  static constexpr int kWheels = WheelErrors::kCount, kLevel = 3, kCamera = 4;
  static constexpr int kCount = kWheels + kLevel + kCamera;
  using Vector = Eigen::Matrix<double, kCount, 1>;
  using Matrix = Eigen::Matrix<double, kCount, kCount>;
  /// Of the wheels, as in WheelErrors; roll and pitch (rad, about the camera, body axes) and height
  /// (m) by which the camera must be moved; DepthCameraError::e (1/m) and ::focal. The camera's
  /// heading and place are the wheels' direction and place.
  Vector value = Vector::Zero();
  Matrix covariance = Matrix::Zero();

  WheelErrors::Vector wheels() const { return value.head<kWheels>(); }
  Eigen::Vector3d level() const { return value.segment<kLevel>(kWheels); }
  DepthCameraError camera() const {
    return {value.segment<3>(kWheels + kLevel), value(kCount - 1)};
  }
};

/// estimate_shared_errors() of a refined graph for these errors. All of its plane factors are taken
/// for the camera's. An error in slope makes a wall turn as the robot comes nearer (by e times its
/// distance), which neither wheels nor a mounting do: walls met from several distances tell it. One
/// in focal length makes walls turn as they cross the image: those seen from all sides tell it.
/// Errors are zero with `prior_information`, of which the graph was corrected by `already`.
std::optional<DepthErrors> estimate_depth_errors(const Graph& graph, const SE3& T_body_camera,
                                                 const DepthErrors::Matrix& prior_information,
                                                 const DepthErrors::Vector& already);

}  // namespace lamina
