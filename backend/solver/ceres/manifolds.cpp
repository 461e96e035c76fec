// Manifolds of poses and planes.
#include <lamina/backend/solver/ceres/manifolds.hpp>

#include <lamina/backend/graph/states.hpp>

namespace lamina {
namespace {
template <int Rows, int Cols>
using RowMajorMap = Eigen::Map<Eigen::Matrix<double, Rows, Cols, Eigen::RowMajor>>;
}  // namespace

bool PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Eigen::Map<const Vector6d> d(delta);
  PoseState(x).plus(d).write(x_plus_delta);
  return true;
}

bool PoseManifold::PlusJacobian(const double* x, double* jacobian) const {
  const PoseState pose(x);
  RowMajorMap<7, 6> J(jacobian);
  J.setZero();
  J.topLeftCorner<3, 3>() = pose.R;
  // q * (w / 2, 1) for a small rotation w: columns of the left product matrix of q, halved.
  const double qx = x[3], qy = x[4], qz = x[5], qw = x[6];
  J.bottomRightCorner<4, 3>() << qw, -qz, qy, qz, qw, -qx, -qy, qx, qw, -qx, -qy, -qz;
  J.bottomRightCorner<4, 3>() *= 0.5;
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const PoseState b(y), a(x);
  const SE3 error(SO3(a.q.conjugate() * b.q), a.R.transpose() * (b.t - a.t));
  Vector6d::Map(y_minus_x) = error.log();
  return true;
}

bool PoseManifold::MinusJacobian(const double* x, double* jacobian) const {
  const PoseState pose(x);
  RowMajorMap<6, 7> J(jacobian);
  J.setZero();
  J.topLeftCorner<3, 3>() = pose.R.transpose();
  const double qx = x[3], qy = x[4], qz = x[5], qw = x[6];
  J.bottomRightCorner<3, 4>() << qw, qz, -qy, -qx, -qz, qw, qx, -qy, qy, -qx, qw, -qz;
  J.bottomRightCorner<3, 4>() *= 2.0;
  return true;
}

bool PlaneManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  PlaneState(x).plus(Eigen::Map<const Eigen::Vector3d>(delta)).write(x_plus_delta);
  return true;
}

bool PlaneManifold::PlusJacobian(const double* x, double* jacobian) const {
  RowMajorMap<4, 3> J(jacobian);
  J.setZero();
  J.topLeftCorner<3, 2>() = PlaneState(x).B;
  J(3, 2) = 1;
  return true;
}

bool PlaneManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  // Not by way of Plane, which would divide y's rho by the length of its normal.
  const PlaneState a(x);
  const Eigen::Vector3d n(y[0], y[1], y[2]);
  Eigen::Vector2d::Map(y_minus_x) = sphere_log(a.n, a.B, n, nullptr);
  y_minus_x[2] = y[3] - a.rho;
  return true;
}

bool PlaneManifold::MinusJacobian(const double* x, double* jacobian) const {
  RowMajorMap<3, 4> J(jacobian);
  J.setZero();
  J.topLeftCorner<2, 3>() = PlaneState(x).B.transpose();
  J(2, 3) = 1;
  return true;
}

bool SubManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  Eigen::VectorXd all = Eigen::VectorXd::Zero(full_.TangentSize());
  all.segment(first_, count_) = Eigen::Map<const Eigen::VectorXd>(delta, count_);
  return full_.Plus(x, all.data(), x_plus_delta);
}

bool SubManifold::PlusJacobian(const double* x, double* jacobian) const {
  RowMajorMap<Eigen::Dynamic, Eigen::Dynamic>::PlainObject all(AmbientSize(), full_.TangentSize());
  if (!full_.PlusJacobian(x, all.data())) return false;
  RowMajorMap<Eigen::Dynamic, Eigen::Dynamic>(jacobian, AmbientSize(), count_) =
      all.middleCols(first_, count_);
  return true;
}

bool SubManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Eigen::VectorXd all(full_.TangentSize());
  if (!full_.Minus(y, x, all.data())) return false;
  Eigen::Map<Eigen::VectorXd>(y_minus_x, count_) = all.segment(first_, count_);
  return true;
}

bool SubManifold::MinusJacobian(const double* x, double* jacobian) const {
  RowMajorMap<Eigen::Dynamic, Eigen::Dynamic>::PlainObject all(full_.TangentSize(), AmbientSize());
  if (!full_.MinusJacobian(x, all.data())) return false;
  RowMajorMap<Eigen::Dynamic, Eigen::Dynamic>(jacobian, count_, AmbientSize()) =
      all.middleRows(first_, count_);
  return true;
}

}  // namespace lamina
