// Exponential, logarithm and Jacobians of rigid motions.
#include <lamina/models/lie/se3.hpp>

#include <cmath>

namespace lamina {
namespace {

// The block that couples translation and rotation in the left Jacobian, [Barfoot2014] eq. 102.
Eigen::Matrix3d coupling(const Eigen::Vector3d& v, const Eigen::Vector3d& w) {
  const Eigen::Matrix3d V = SO3::hat(v);
  const Eigen::Matrix3d W = SO3::hat(w);
  const double t2 = w.squaredNorm();
  double a, b, c;
  if (t2 < 2.5e-3) {
    const double t4 = t2 * t2;
    a = 1.0 / 6.0 - t2 / 120.0 + t4 / 5040.0 - t2 * t4 / 362880.0;
    b = 1.0 / 24.0 - t2 / 720.0 + t4 / 40320.0 - t2 * t4 / 3628800.0;
    c = 1.0 / 120.0 - t2 / 2520.0 + t4 / 120960.0 - t2 * t4 / 9979200.0;
  } else {
    const double t = std::sqrt(t2);
    const double s = std::sin(t);
    const double half = std::sin(0.5 * t);
    const double one_minus_cos = 2.0 * half * half;
    a = (t - s) / (t2 * t);
    b = (0.5 * t2 - one_minus_cos) / (t2 * t2);
    c = 0.5 * ((2.0 * t + t * std::cos(t) - 3.0 * s) / (t2 * t2 * t));
  }
  const Eigen::Matrix3d WV = W * V, VW = V * W, WVW = W * VW;
  return 0.5 * V + a * (WV + VW + WVW) + b * (W * WV + VW * W - 3.0 * WVW) +
         c * (WVW * W + W * WVW);
}

}  // namespace

SE3 SE3::exp(const Vector6d& d) {
  const Eigen::Vector3d w = d.tail<3>();
  return SE3(SO3::exp(w), SO3::left_jacobian(w) * d.head<3>());
}

Vector6d SE3::log() const {
  Vector6d d;
  d.tail<3>() = so3_.log();
  d.head<3>() = SO3::left_jacobian_inverse(d.tail<3>()) * t_;
  return d;
}

SE3 SE3::inverse() const {
  const SO3 R = so3_.inverse();
  return SE3(R, -(R * t_));
}

Eigen::Matrix4d SE3::matrix() const {
  Eigen::Matrix4d M = Eigen::Matrix4d::Identity();
  M.topLeftCorner<3, 3>() = so3_.matrix();
  M.topRightCorner<3, 1>() = t_;
  return M;
}

Matrix6d SE3::adjoint() const {
  const Eigen::Matrix3d R = so3_.matrix();
  Matrix6d A = Matrix6d::Zero();
  A.topLeftCorner<3, 3>() = R;
  A.topRightCorner<3, 3>() = SO3::hat(t_) * R;
  A.bottomRightCorner<3, 3>() = R;
  return A;
}

Eigen::Matrix4d SE3::hat(const Vector6d& d) {
  Eigen::Matrix4d D = Eigen::Matrix4d::Zero();
  D.topLeftCorner<3, 3>() = SO3::hat(d.tail<3>());
  D.topRightCorner<3, 1>() = d.head<3>();
  return D;
}

Vector6d SE3::vee(const Eigen::Matrix4d& D) {
  Vector6d d;
  d.head<3>() = D.topRightCorner<3, 1>();
  d.tail<3>() = SO3::vee(D.topLeftCorner<3, 3>());
  return d;
}

Matrix6d SE3::left_jacobian(const Vector6d& d) {
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = SO3::left_jacobian(d.tail<3>());
  J.bottomRightCorner<3, 3>() = J.topLeftCorner<3, 3>();
  J.topRightCorner<3, 3>() = coupling(d.head<3>(), d.tail<3>());
  return J;
}

Matrix6d SE3::left_jacobian_inverse(const Vector6d& d) {
  const Eigen::Matrix3d Ji = SO3::left_jacobian_inverse(d.tail<3>());
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = Ji;
  J.bottomRightCorner<3, 3>() = Ji;
  J.topRightCorner<3, 3>() = -Ji * coupling(d.head<3>(), d.tail<3>()) * Ji;
  return J;
}

SE3 SE3::interpolate(const SE3& a, const SE3& b, double s) {
  return a * SE3::exp(s * (a.inverse() * b).log());
}

}  // namespace lamina
