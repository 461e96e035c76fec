// How a sensor sits, put right.
#pragma once

#include <Eigen/Core>

#include <lamina/models/lie/se3.hpp>

namespace lamina {

/// What must be done to a mounting T_body_sensor: turned by `rotation_body` (axis-angle, rad, body
/// axes) about the sensor, then moved by `translation_body` (m).
struct MountingCorrection {
  Eigen::Vector3d rotation_body = Eigen::Vector3d::Zero();
  Eigen::Vector3d translation_body = Eigen::Vector3d::Zero();

  SE3 apply(const SE3& T_body_sensor) const {
    return SE3(SO3::exp(rotation_body) * T_body_sensor.so3(),
               T_body_sensor.translation() + translation_body);
  }
};

}  // namespace lamina
