// States as factors read them: matrices made once per linearisation point, not once per factor.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <tuple>

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/plane.hpp>

namespace lamina {

/// T_map_body. Parameter block of 7: translation, quaternion x y z w. Tangent of 6: (translation,
/// rotation) on the right.
struct PoseState {
  static constexpr int kAmbient = 7, kTangent = 6;
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();

  PoseState() = default;
  explicit PoseState(const SE3& T)
      : q(T.so3().quaternion()), t(T.translation()), R(T.so3().matrix()) {}
  /// Normalises the quaternion, so that the block may be off the sphere a little.
  explicit PoseState(const double* x)
      : q(Eigen::Map<const Eigen::Quaterniond>(x + 3).normalized()), t(x[0], x[1], x[2]) {
    R = q.toRotationMatrix();
  }
  SE3 se3() const { return SE3(SO3(q), t); }
  PoseState operator*(const PoseState& b) const {
    PoseState ab;
    ab.q = q * b.q;
    ab.t = R * b.t + t;
    ab.R = R * b.R;
    return ab;
  }
  PoseState plus(const Vector6d& d) const { return PoseState(se3() * SE3::exp(d)); }
  void write(double* x) const {
    Eigen::Vector3d::Map(x) = t;
    Eigen::Vector4d::Map(x + 3) = q.coeffs();
  }
};

/// A plane about its landmark's anchor, map axes. Parameter block of 4: normal, rho. Tangent of 3:
/// two tilts along the columns of B, and rho.
struct PlaneState {
  static constexpr int kAmbient = 4, kTangent = 3;
  Eigen::Vector3d n = Eigen::Vector3d::UnitZ();
  double rho = 0;
  Matrix32d B = Plane::tangent_basis(Eigen::Vector3d::UnitZ());

  PlaneState() = default;
  explicit PlaneState(const Plane& plane)
      : n(plane.normal()), rho(plane.rho()), B(plane.tangent_basis()) {}
  explicit PlaneState(const double* x)
      : n(x[0], x[1], x[2]), rho(x[3]), B(Plane::tangent_basis(n)) {}
  Plane plane() const { return Plane(n, rho); }
  PlaneState plus(const Eigen::Vector3d& d) const { return PlaneState(plane().boxplus(d)); }
  /// The same step with the basis carried along: coordinates in it do not jump where
  /// Plane::tangent_basis() does.
  PlaneState carried(const Eigen::Vector3d& d) const;
  /// The step from `origin` to this plane, in the basis of `origin`.
  Eigen::Vector3d minus(const PlaneState& origin) const;
  /// The same plane with axes turned by R.
  PlaneState turned(const Eigen::Matrix3d& R) const;
  void write(double* x) const {
    Eigen::Vector3d::Map(x) = n;
    x[3] = rho;
  }
};

/// Three numbers in a flat space: a surfel (height, slopes).
struct FlatState {
  static constexpr int kAmbient = 3, kTangent = 3;
  Eigen::Vector3d x = Eigen::Vector3d::Zero();

  FlatState() = default;
  explicit FlatState(const Eigen::Vector3d& value) : x(value) {}
  explicit FlatState(const double* value) : x(value[0], value[1], value[2]) {}
  FlatState plus(const Eigen::Vector3d& d) const { return FlatState(Eigen::Vector3d(x + d)); }
  void write(double* out) const { Eigen::Vector3d::Map(out) = x; }
};

/// What every factor's term offers, so that Ceres and the own solver use the same code:
///   using Jacobians = TermJacobians<N, States...>;
///   void evaluate(const States&..., Vector<N>& residual, Jacobians* jacobians) const;
/// Jacobians are taken to the states' tangents; a null pointer asks for the residual alone.
template <int N, class... States>
using TermJacobians = std::tuple<Eigen::Matrix<double, N, States::kTangent>...>;

/// v = theta / sin(theta) * B0^T n: the geodesic from n0 to n in the basis B0 of n0's tangent, and
/// its derivative to n (2x3). At the antipode v = (pi, 0) and the derivative is zero.
Eigen::Vector2d sphere_log(const Eigen::Vector3d& n0, const Matrix32d& B0, const Eigen::Vector3d& n,
                           Eigen::Matrix<double, 2, 3>* dv_dn);

/// Rows l_k with S = sum l_k l_k^T, the largest first, negligible ones (below 1e-12 of the
/// largest) zero: a square root that exists for any semidefinite S.
Eigen::Matrix3d scatter_root(const Eigen::Matrix3d& scatter);

}  // namespace lamina
