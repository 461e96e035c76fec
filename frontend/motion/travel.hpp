// Whether a camera's body is carried sideways or up, or only seems to be.
#pragma once

#include <lamina/models/lie/se3.hpp>

namespace lamina {

/// The translation (m/s, body) of a velocity that goes sideways or up, else zero: beside the way
/// ahead of a body on wheels, and beside a turn, errors of images do that.
inline Eigen::Vector3d travel_aside(const Vector6d& velocity) {
  constexpr double kShare = 0.25, kLever = 0.25;  // of the speed; m
  const double aside = velocity.segment<2>(1).norm();
  const bool observed =
      aside > kShare * velocity.head<3>().norm() && aside > kLever * velocity.tail<3>().norm();
  return observed ? Eigen::Vector3d(velocity.head<3>()) : Eigen::Vector3d::Zero();
}

}  // namespace lamina
