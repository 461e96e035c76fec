// Covariances (right tangent: translation, rotation; m, rad) of motions that nothing measured.
#pragma once

#include <algorithm>

#include <lamina/models/lie/se3.hpp>

namespace lamina {

/// The same in every direction.
inline Matrix6d round_covariance(double metres, double radians) {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(metres * metres),
      Eigen::Vector3d::Constant(radians * radians);
  return variances.asDiagonal();
}

/// Where nothing measured the motion: anything a robot does between two frames is likely.
inline Matrix6d still_covariance() { return round_covariance(0.3, 0.3); }

/// The same over a time that may be short, s.
inline Matrix6d still_covariance(double dt) {
  constexpr double kSurest = 1e-4, kFastest = 2;  // m, rad; m/s, rad/s
  const double most = std::min(0.3, kSurest + kFastest * dt);
  return round_covariance(most, most);
}

/// A robot that was carried away may be anywhere near; the loops that find it say where.
inline Matrix6d carried_away() {
  constexpr double kMetres = 1, kRadians = 0.5;
  Vector6d variances = Vector6d::Zero();
  variances.head<2>().setConstant(kMetres * kMetres);
  variances(5) = kRadians * kRadians;
  return variances.asDiagonal();
}

/// Odometry that what was seen contradicts: where it says nothing else does, its word stays.
inline Matrix6d any_motion() { return round_covariance(100, 0.5); }

/// Odometry that leapt away from the motion that what was seen bears out: by how much is not known,
/// which way is. Position and attitude may have leapt apart. `leap` in the scanner's tangent.
inline Matrix6d leap_of_unknown_size(const Vector6d& leap, const SE3& T_body_lidar) {
  const Vector6d body = T_body_lidar.adjoint() * leap;
  Matrix6d covariance = Matrix6d::Zero();
  covariance.topLeftCorner<3, 3>() = body.head<3>() * body.head<3>().transpose();
  covariance.bottomRightCorner<3, 3>() = body.tail<3>() * body.tail<3>().transpose();
  return covariance;
}

}  // namespace lamina
