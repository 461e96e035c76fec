// Exponential, logarithm and Jacobians of rotations, with series near zero.
#include <lamina/models/lie/so3.hpp>

#include <Eigen/SVD>
#include <cmath>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {
// Below this squared angle the closed forms lose digits and the series is exact to double.
constexpr double kSmallAngleSquared = 1e-6;
}  // namespace

SO3::SO3(const Eigen::Quaterniond& q) {
  const double norm = q.norm();
  if (!std::isfinite(norm) || norm < 1e-12) {
    throw Error("rotation: found a zero or non-finite quaternion, expected x y z w of unit length");
  }
  // Unit to rounding already: kept as it is, so that what was written reads back bit for bit.
  q_ = std::abs(norm - 1.0) < 1e-15 ? q : Eigen::Quaterniond(q.coeffs() / norm);
}

SO3 SO3::from_matrix(const Eigen::Matrix3d& R) {
  if (!R.allFinite() || R.determinant() <= 0) {
    throw Error("rotation: found a matrix that is no rotation, expected determinant 1");
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return SO3(Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * svd.matrixV().transpose())));
}

SO3 SO3::exp(const Eigen::Vector3d& w) {
  const double t2 = w.squaredNorm();
  double imaginary, real;
  if (t2 < kSmallAngleSquared) {
    imaginary = 0.5 - t2 / 48.0 + t2 * t2 / 3840.0;
    real = 1.0 - t2 / 8.0 + t2 * t2 / 384.0;
  } else {
    const double t = std::sqrt(t2);
    imaginary = std::sin(0.5 * t) / t;
    real = std::cos(0.5 * t);
  }
  Eigen::Quaterniond q(real, imaginary * w.x(), imaginary * w.y(), imaginary * w.z());
  q.normalize();
  return SO3(q, Unchecked{});
}

Eigen::Vector3d SO3::log() const {
  // atan2 of the vector part is exact at both ends: small angles and angles near pi.
  const double sign = q_.w() < 0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * q_.vec();
  const double w = sign * q_.w();
  const double n2 = v.squaredNorm();
  if (n2 < 1e-14) return (2.0 / w - 2.0 / 3.0 * n2 / (w * w * w)) * v;
  const double n = std::sqrt(n2);
  return (2.0 * std::atan2(n, w) / n) * v;
}

SO3 SO3::operator*(const SO3& other) const {
  Eigen::Quaterniond q = q_ * other.q_;
  q.normalize();
  return SO3(q, Unchecked{});
}

double SO3::yaw() const {
  const Eigen::Vector3d x = q_ * Eigen::Vector3d::UnitX();
  return std::atan2(x.y(), x.x());
}

Eigen::Matrix3d SO3::hat(const Eigen::Vector3d& w) {
  Eigen::Matrix3d W;
  W << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return W;
}

Eigen::Vector3d SO3::vee(const Eigen::Matrix3d& W) { return {W(2, 1), W(0, 2), W(1, 0)}; }

Eigen::Matrix3d SO3::left_jacobian(const Eigen::Vector3d& w) {
  const double t2 = w.squaredNorm();
  double a, b;  // (1 - cos t) / t^2, (t - sin t) / t^3
  if (t2 < kSmallAngleSquared) {
    a = 0.5 - t2 / 24.0 + t2 * t2 / 720.0;
    b = 1.0 / 6.0 - t2 / 120.0 + t2 * t2 / 5040.0;
  } else {
    const double t = std::sqrt(t2);
    const double s = std::sin(0.5 * t);
    a = 2.0 * s * s / t2;
    b = (t - std::sin(t)) / (t2 * t);
  }
  const Eigen::Matrix3d W = hat(w);
  return Eigen::Matrix3d::Identity() + a * W + b * W * W;
}

Eigen::Matrix3d SO3::left_jacobian_inverse(const Eigen::Vector3d& w) {
  const double t2 = w.squaredNorm();
  double c;  // 1/t^2 - (1 + cos t) / (2 t sin t)
  if (t2 < 1e-4) {
    c = 1.0 / 12.0 + t2 / 720.0 + t2 * t2 / 30240.0 + t2 * t2 * t2 / 1209600.0;
  } else {
    const double t = std::sqrt(t2);
    // cot(t/2) form: finite at pi, where (1 + cos t) / sin t is 0 / 0.
    c = (1.0 - 0.5 * t / std::tan(0.5 * t)) / t2;
  }
  const Eigen::Matrix3d W = hat(w);
  return Eigen::Matrix3d::Identity() - 0.5 * W + c * W * W;
}

}  // namespace lamina
