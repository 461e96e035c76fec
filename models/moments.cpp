// Centred sums, plane and line fits.
#include <lamina/models/moments.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/linalg.hpp>

namespace lamina {

Moments::Moments(double weight, const Eigen::Vector3d& mean, const Eigen::Matrix3d& scatter,
                 std::int64_t count)
    : weight_(weight), mean_(mean), scatter_(scatter), count_(count) {}

std::optional<Moments> Moments::from_homogeneous(const Eigen::Matrix4d& M, std::int64_t count) {
  const double w = M(3, 3);
  if (!M.allFinite() || !(w > 0)) return std::nullopt;
  const Eigen::Vector3d mean = M.topRightCorner<3, 1>() / w;
  const Eigen::Matrix3d scatter = M.topLeftCorner<3, 3>() - w * mean * mean.transpose();
  return Moments(w, mean, scatter, count);
}

void Moments::add(const Eigen::Vector3d& point, double weight) {
  if (!point.allFinite() || !(weight > 0) || !std::isfinite(weight)) return;
  const double total = weight_ + weight;
  const Eigen::Vector3d delta = point - mean_;
  mean_ += (weight / total) * delta;
  scatter_ += (weight_ * weight / total) * Eigen::Matrix3d(delta * delta.transpose());
  weight_ = total;
  ++count_;
}

void Moments::remove(const Eigen::Vector3d& point, double weight) {
  subtract(Moments(weight, point, Eigen::Matrix3d::Zero(), 1));
}

void Moments::merge(const Moments& other) {
  if (other.weight_ <= 0) return;
  const double total = weight_ + other.weight_;
  const Eigen::Vector3d delta = other.mean_ - mean_;
  mean_ += (other.weight_ / total) * delta;
  scatter_ += other.scatter_ +
              (weight_ * other.weight_ / total) * Eigen::Matrix3d(delta * delta.transpose());
  weight_ = total;
  count_ += other.count_;
}

void Moments::subtract(const Moments& other) {
  const double rest = weight_ - other.weight_;
  if (rest <= 1e-12 * weight_) {
    *this = Moments();
    return;
  }
  const Eigen::Vector3d delta = mean_ - other.mean_;
  mean_ += (other.weight_ / rest) * delta;
  scatter_ -= other.scatter_ +
              (weight_ * other.weight_ / rest) * Eigen::Matrix3d(delta * delta.transpose());
  weight_ = rest;
  count_ = std::max<std::int64_t>(0, count_ - other.count_);
}

Moments Moments::transformed(const SE3& T_a_b) const {
  const Eigen::Matrix3d R = T_a_b.so3().matrix();
  return Moments(weight_, T_a_b * mean_, R * scatter_ * R.transpose(), count_);
}

Moments Moments::scaled(double factor) const {
  return Moments(weight_ * factor, mean_, scatter_ * factor, count_);
}

Eigen::Matrix4d Moments::homogeneous() const {
  Eigen::Matrix4d M;
  M.topLeftCorner<3, 3>() = scatter_ + weight_ * mean_ * mean_.transpose();
  M.topRightCorner<3, 1>() = weight_ * mean_;
  M.bottomLeftCorner<1, 3>() = weight_ * mean_.transpose();
  M(3, 3) = weight_;
  return M;
}

double Moments::cost(const Plane& plane) const {
  const double d = plane.signed_distance(mean_);
  return plane.normal().dot(scatter_ * plane.normal()) + weight_ * d * d;
}

std::optional<PlaneFit> Moments::fit_plane(const Eigen::Vector3d& seen_from,
                                           std::optional<double> sigma) const {
  if (count_ < 3 || !(weight_ > 0) || !scatter_.allFinite() || !mean_.allFinite()) {
    return std::nullopt;
  }
  const SymmetricEigen<3> eigen = symmetric_eigen(Eigen::Matrix3d(scatter_ / weight_));
  const Eigen::Vector3d values = eigen.values.cwiseMax(0.0);
  if (!(values(2) > 0) || values(1) <= 1e-12 * values(2)) return std::nullopt;
  Eigen::Vector3d normal = eigen.vectors.col(0);
  if (normal.dot(seen_from - mean_) < 0) normal = -normal;

  PlaneFit fit;
  fit.plane = Plane(normal, normal.dot(mean_));
  fit.eigenvalues = values;
  fit.rms = std::sqrt(values(0));
  double variance = 1.0;
  if (sigma) {
    variance = *sigma * *sigma;
  } else {
    // Residual variance of unit-weight points; three parameters were fitted.
    const double degrees = std::max(1.0, static_cast<double>(count_) - 3.0);
    variance = values(0) * weight_ / degrees;
  }
  const Matrix32d B = fit.plane.tangent_basis();
  const Eigen::Matrix2d tilt_information = B.transpose() * scatter_ * B;
  fit.covariance.setZero();
  fit.covariance.topLeftCorner<2, 2>() = variance * tilt_information.inverse();
  fit.covariance(2, 2) = variance / weight_;
  return fit;
}

std::optional<Moments::LineFit> Moments::fit_line(std::optional<double> sigma) const {
  if (count_ < 2 || !(weight_ > 0) || !scatter_.allFinite() || !mean_.allFinite()) {
    return std::nullopt;
  }
  const SymmetricEigen<3> eigen = symmetric_eigen(Eigen::Matrix3d(scatter_ / weight_));
  const Eigen::Vector3d values = eigen.values.cwiseMax(0.0);
  if (!(values(2) > 0)) return std::nullopt;
  // Two residuals a point, four parameters were fitted.
  const double degrees = std::max(1.0, 2.0 * static_cast<double>(count_) - 4.0);
  const double variance = sigma ? *sigma * *sigma : (values(0) + values(1)) * weight_ / degrees;
  LineFit fit{eigen.vectors.col(2), std::sqrt(values(0) + values(1)), Eigen::Matrix4d::Zero()};
  fit.covariance.diagonal() << Eigen::Vector2d::Constant(variance / (values(2) * weight_)),
      Eigen::Vector2d::Constant(variance / weight_);
  return fit;
}

Moments Moments::discounted(const Eigen::Vector3d& normal, const NoiseFloor& floor) const {
  if (!(weight_ > 0)) return *this;
  const Matrix32d B = Plane::tangent_basis(normal);
  const Eigen::Matrix2d in_plane = B.transpose() * scatter_ * B;
  const SymmetricEigen<2> eigen = symmetric_eigen(in_plane);
  constexpr double kMostBend = 0.1;  // rad
  Eigen::Matrix2d kept = Eigen::Matrix2d::Zero();
  for (int i = 0; i < 2; ++i) {
    const double information = std::max(0.0, eigen.values(i));
    const Eigen::Vector2d axis = eigen.vectors.col(i);
    const double bend = floor.sigma_bend * std::sqrt(weight_ / std::max(information, 1e-12));
    const double tilt = std::max(floor.sigma_tilt, std::min(kMostBend, bend));
    const double tilt_variance = tilt * tilt;
    kept += information / (1.0 + information * tilt_variance) * axis * axis.transpose();
  }
  const double weight = weight_ / (1.0 + weight_ * floor.sigma_rho * floor.sigma_rho);
  return Moments(weight, mean_, B * kept * B.transpose(), count_);
}

}  // namespace lamina
