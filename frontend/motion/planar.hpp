// Planar poses for scan matching, and how they relate to rigid motions of the body.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/plane.hpp>

namespace lamina {

/// Angle brought into (-pi, pi].
inline double wrap_angle(double a) {
  constexpr double kPi = 3.14159265358979323846;
  a = std::remainder(a, 2 * kPi);
  return a <= -kPi ? kPi : a;
}

/// T_a_b in a plane: maps b to a. Tangent (x, y, yaw) on the right, as SE3 has it.
struct PlanarPose {
  double x = 0, y = 0, yaw = 0;  ///< m, m, rad

  Eigen::Vector2d translation() const { return {x, y}; }
  Eigen::Matrix2d rotation() const {
    const double c = std::cos(yaw), s = std::sin(yaw);
    return (Eigen::Matrix2d() << c, -s, s, c).finished();
  }
  PlanarPose operator*(const PlanarPose& b) const {
    const double c = std::cos(yaw), s = std::sin(yaw);
    return {x + c * b.x - s * b.y, y + s * b.x + c * b.y, wrap_angle(yaw + b.yaw)};
  }
  Eigen::Vector2d operator*(const Eigen::Vector2d& p) const {
    const double c = std::cos(yaw), s = std::sin(yaw);
    return {x + c * p.x() - s * p.y(), y + s * p.x() + c * p.y()};
  }
  PlanarPose inverse() const {
    const double c = std::cos(yaw), s = std::sin(yaw);
    return {-c * x - s * y, s * x - c * y, wrap_angle(-yaw)};
  }
  /// Moved by a small d = (x, y, yaw) given in the own frame.
  PlanarPose boxplus(const Eigen::Vector3d& d) const {
    return *this * PlanarPose{d.x(), d.y(), d.z()};
  }
  /// Adjoint: how a right perturbation of b looks from before T: T * d = (Ad d) * T.
  Eigen::Matrix3d adjoint() const {
    const double c = std::cos(yaw), s = std::sin(yaw);
    return (Eigen::Matrix3d() << c, -s, y, s, c, -x, 0, 0, 1).finished();
  }
};

template <class A>
void fields(A& a, PlanarPose& v) {
  a(v.x, v.y, v.yaw);
}

/// The part of a body's motion that lies in its own x-y plane, and back.
inline PlanarPose planar_part(const SE3& T) {
  return {T.translation().x(), T.translation().y(), T.so3().yaw()};
}
inline SE3 lifted(const PlanarPose& T) { return SE3::planar(T.x, T.y, T.yaw); }

/// Whether the scanner's plane is the body's, to `max_tilt` (rad).
inline bool is_level(const SE3& T_body_lidar, double max_tilt) {
  const Eigen::Vector3d z_body = T_body_lidar.so3() * Eigen::Vector3d::UnitZ();
  return std::abs(z_body.z()) >= std::cos(max_tilt);
}

/// T_map_body of a body that sees this floor: floor at z = 0, origin above (0, 0), x of the map
/// along the body's heading.
inline SE3 levelled_pose(const Plane& floor_body) {
  const SO3 level(
      Eigen::Quaterniond::FromTwoVectors(floor_body.normal(), Eigen::Vector3d::UnitZ()));
  return SE3(SO3::rot_z(-level.yaw()) * level, {0, 0, -floor_body.rho()});
}

/// Rows x, y, yaw of a 6x6 covariance in the tangent (translation, rotation).
inline Eigen::Matrix3d planar_block(const Matrix6d& covariance) {
  constexpr int kIndex[3] = {0, 1, 5};
  Eigen::Matrix3d block;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) block(i, j) = covariance(kIndex[i], kIndex[j]);
  }
  return block;
}

/// Puts `block` in rows x, y, yaw and clears what ties them to the other three.
inline void set_planar_block(const Eigen::Matrix3d& block, Matrix6d& covariance) {
  constexpr int kIn[3] = {0, 1, 5}, kOut[3] = {2, 3, 4};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      covariance(kIn[i], kIn[j]) = block(i, j);
      covariance(kIn[i], kOut[j]) = covariance(kOut[j], kIn[i]) = 0;
    }
  }
}

}  // namespace lamina
