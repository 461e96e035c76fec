// Systematic errors of wheel odometry, and increments without them.
#pragma once

#include <Eigen/Core>

#include <lamina/models/lie/se3.hpp>

namespace lamina {

/// Systematic errors of planar odometry over an increment that it measured as (t, yaw):
///   yaw_true = yaw + turn,  turn = drift |t| + turn_scale yaw,
///   t_true = (1 + scale) Rz(turn / 2 + direction) t + (Rz(yaw_true) - I) place.
/// True increments are those of the frame in which sensors are said to sit. Its axes are turned by
/// -direction against the wheels', its origin lies at `place` from theirs, in its own axes.
struct WheelErrors {
  static constexpr int kCount = 6;
  using Vector = Eigen::Matrix<double, kCount, 1>;
  using Matrix = Eigen::Matrix<double, kCount, kCount>;
  /// scale (1), drift (rad/m), turn_scale (1), direction (rad), place (x, y; m)
  Vector value = Vector::Zero();
  Matrix covariance = Matrix::Zero();

  static Vector of(double scale, double drift, double turn_scale, double direction = 0,
                   double x = 0, double y = 0) {
    return (Vector() << scale, drift, turn_scale, direction, x, y).finished();
  }

  /// Chi-squared of 6 degrees of freedom: how far the errors stand out from none.
  double significance() const;
};

/// The increment as these errors correct it.
SE3 corrected(const SE3& T_from_to, const WheelErrors::Vector& errors);

}  // namespace lamina
