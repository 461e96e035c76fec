// Rigid motions in three dimensions, Sophus-style.
#pragma once

#include <Eigen/Core>

#include <lamina/models/lie/so3.hpp>

namespace lamina {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// T_a_b: maps coordinates in b to coordinates in a. Tangent d = (translation, rotation), applied
/// on the right: T * exp(d). Formulas: [Sola2018], [Barfoot2014].
class SE3 {
 public:
  SE3() : t_(Eigen::Vector3d::Zero()) {}
  SE3(const SO3& rotation, const Eigen::Vector3d& translation) : so3_(rotation), t_(translation) {}
  static SE3 from_translation(const Eigen::Vector3d& t) { return SE3(SO3(), t); }
  static SE3 exp(const Vector6d& d);
  /// A planar pose: x, y and heading about z.
  static SE3 planar(double x, double y, double yaw) { return SE3(SO3::rot_z(yaw), {x, y, 0}); }

  Vector6d log() const;
  SE3 inverse() const;
  SE3 operator*(const SE3& other) const { return SE3(so3_ * other.so3_, so3_ * other.t_ + t_); }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return so3_ * point + t_; }
  Eigen::Matrix4d matrix() const;
  /// Adj(T) d = log(T exp(d) T^-1): [R, hat(t) R; 0, R].
  Matrix6d adjoint() const;

  const SO3& so3() const { return so3_; }
  const Eigen::Vector3d& translation() const { return t_; }

  /// 4x4 twist of d, and back.
  static Eigen::Matrix4d hat(const Vector6d& d);
  static Vector6d vee(const Eigen::Matrix4d& D);
  /// exp(d + e) = exp(Jl e) exp(d) + O(e^2).
  static Matrix6d left_jacobian(const Vector6d& d);
  static Matrix6d left_jacobian_inverse(const Vector6d& d);
  /// exp(d + e) = exp(d) exp(Jr e) + O(e^2); Jr(d) = Jl(-d).
  static Matrix6d right_jacobian(const Vector6d& d) { return left_jacobian(-d); }
  static Matrix6d right_jacobian_inverse(const Vector6d& d) { return left_jacobian_inverse(-d); }

  /// Geodesic between two poses: a * exp(s * log(a^-1 b)); s = 0 gives a, s = 1 gives b.
  static SE3 interpolate(const SE3& a, const SE3& b, double s);

 private:
  SO3 so3_;
  Eigen::Vector3d t_;
};

}  // namespace lamina
