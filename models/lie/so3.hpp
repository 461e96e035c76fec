// Rotations in three dimensions, Sophus-style.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace lamina {

/// A rotation held as a unit Hamilton quaternion (storage x y z w). Tangent vectors are rotation
/// vectors in radians, applied on the right: R * exp(w).
/// Formulas: [Sola2018]; Jacobians: [Chirikjian2012], in docs/references.md.
class SO3 {
 public:
  SO3() : q_(Eigen::Quaterniond::Identity()) {}
  /// Normalises; throws lamina::Error for a zero or non-finite quaternion.
  explicit SO3(const Eigen::Quaterniond& q);
  /// The nearest rotation (polar decomposition); throws lamina::Error when det <= 0 or not finite.
  static SO3 from_matrix(const Eigen::Matrix3d& R);
  static SO3 exp(const Eigen::Vector3d& w);
  static SO3 rot_x(double angle) { return exp({angle, 0, 0}); }
  static SO3 rot_y(double angle) { return exp({0, angle, 0}); }
  static SO3 rot_z(double angle) { return exp({0, 0, angle}); }

  /// Rotation vector of length in [0, pi]; exact near 0 and near pi.
  Eigen::Vector3d log() const;
  SO3 inverse() const { return SO3(q_.conjugate(), Unchecked{}); }
  /// Renormalises, so that long chains stay unit.
  SO3 operator*(const SO3& other) const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& v) const { return q_ * v; }
  Eigen::Matrix3d matrix() const { return q_.toRotationMatrix(); }
  /// Adj(R) w = log(R exp(w) R^-1), which is the rotation matrix itself.
  Eigen::Matrix3d adjoint() const { return matrix(); }
  const Eigen::Quaterniond& quaternion() const { return q_; }
  /// Heading: the angle of R x in the x-y plane.
  double yaw() const;

  static Eigen::Matrix3d hat(const Eigen::Vector3d& w);
  static Eigen::Vector3d vee(const Eigen::Matrix3d& W);
  /// exp(w + d) = exp(Jl d) exp(w) + O(d^2).
  static Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& w);
  static Eigen::Matrix3d left_jacobian_inverse(const Eigen::Vector3d& w);
  /// exp(w + d) = exp(w) exp(Jr d) + O(d^2); Jr(w) = Jl(-w).
  static Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& w) { return left_jacobian(-w); }
  static Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& w) {
    return left_jacobian_inverse(-w);
  }

 private:
  struct Unchecked {};
  SO3(const Eigen::Quaterniond& q, Unchecked) : q_(q) {}
  Eigen::Quaterniond q_;
};

}  // namespace lamina
