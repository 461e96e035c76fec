// Prediction by rigid motion with analytic Jacobians; a two-row Kalman update.
#include <lamina/frontend/segments/plane_filter.hpp>

#include <Eigen/LU>
#include <cmath>

namespace lamina {
namespace {
// sin of the least angle between plane and scan at which the line is still defined well.
constexpr double kMinSine = 0.05;

// d(rho, theta, k) for a change of the unscaled normal and offset; g is the scaled x-y normal.
Eigen::Vector3d scaled_change(const Eigen::Vector3d& dN, double draw, const Eigen::Vector2d& g,
                              double m, double rho, double k) {
  const double dm = g.x() * dN.x() + g.y() * dN.y();
  return {(draw - rho * dm) / m, (g.x() * dN.y() - g.y() * dN.x()) / m, (dN.z() - k * dm) / m};
}
}  // namespace

double angle_difference(double a, double b) { return std::remainder(a - b, 2 * M_PI); }

Eigen::Matrix2d observation_covariance(const ScanSegment& segment, const NoiseFloor& floor) {
  const Eigen::Vector3d& mean = segment.moments.mean();
  const double along = -std::sin(segment.theta) * mean.x() + std::cos(segment.theta) * mean.y();
  const Eigen::Vector2d tilt(along, 1.0);
  Eigen::Matrix2d R = segment.covariance;
  R += floor.sigma_tilt * floor.sigma_tilt * tilt * tilt.transpose();
  R(0, 0) += floor.sigma_rho * floor.sigma_rho;
  return R;
}

PlaneFilter::PlaneFilter(const ScanSegment& segment, const NoiseFloor& floor, double sigma_tilt)
    : state_(segment.rho, segment.theta, 0) {
  P_.setZero();
  P_.topLeftCorner<2, 2>() = observation_covariance(segment, floor);
  P_(2, 2) = sigma_tilt * sigma_tilt;
}

std::optional<PlaneFilter> PlaneFilter::from_plane(const Plane& plane_scanner,
                                                   const Eigen::Matrix3d& covariance) {
  Eigen::Vector3d N = plane_scanner.normal();
  double rho = plane_scanner.rho(), sign = 1;
  if (rho < 0) {  // the line's equation points away from the scanner
    N = -N;
    rho = -rho;
    sign = -1;
  }
  const double m = std::hypot(N.x(), N.y());
  if (m < kMinSine) return std::nullopt;
  PlaneFilter filter;
  const Eigen::Vector2d g(N.x() / m, N.y() / m);
  filter.state_ = {rho / m, std::atan2(g.y(), g.x()), N.z() / m};
  const Matrix32d basis = plane_scanner.tangent_basis();
  Eigen::Matrix3d J;
  for (int i = 0; i < 2; ++i) {
    J.col(i) = scaled_change(sign * basis.col(i), 0, g, m, filter.state_(0), filter.state_(2));
  }
  J.col(2) = scaled_change(Eigen::Vector3d::Zero(), sign, g, m, filter.state_(0), filter.state_(2));
  filter.P_ = J * covariance * J.transpose();
  return filter;
}

bool PlaneFilter::predict(const SE3& T_curr_prev, const Matrix6d& motion_covariance) {
  const Eigen::Matrix3d R = T_curr_prev.so3().matrix();
  const Eigen::Vector3d& t = T_curr_prev.translation();
  const double c = std::cos(state_(1)), s = std::sin(state_(1));
  const Eigen::Vector3d N = R * Eigen::Vector3d(c, s, state_(2));
  const double raw = state_(0) + N.dot(t), m = std::hypot(N.x(), N.y());
  if (!(m > kMinSine * N.norm()) || !(raw > 0)) return false;
  const Eigen::Vector2d g(N.x() / m, N.y() / m);
  const double rho = raw / m, k = N.z() / m;
  const Eigen::Vector3d N_theta = R * Eigen::Vector3d(-s, c, 0), N_k = R.col(2);
  Eigen::Matrix3d F;
  F.col(0) = scaled_change(Eigen::Vector3d::Zero(), 1, g, m, rho, k);
  F.col(1) = scaled_change(N_theta, N_theta.dot(t), g, m, rho, k);
  F.col(2) = scaled_change(N_k, N_k.dot(t), g, m, rho, k);
  Eigen::Matrix<double, 3, 6> G;  // of a small motion of the new scanner frame
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(i);
    G.col(i) = scaled_change(Eigen::Vector3d::Zero(), -N(i), g, m, rho, k);
    G.col(3 + i) = scaled_change(-axis.cross(N), 0, g, m, rho, k);
  }
  const Eigen::Matrix3d moved = F * P_ * F.transpose() + G * motion_covariance * G.transpose();
  P_ = 0.5 * (moved + moved.transpose());
  state_ = {rho, std::atan2(g.y(), g.x()), k};
  return state_.allFinite() && P_.allFinite();
}

LinePrediction PlaneFilter::line() const {
  return {state_(0), state_(1), P_.topLeftCorner<2, 2>()};
}

void PlaneFilter::update(const ScanSegment& segment, const Eigen::Matrix2d& R) {
  const Eigen::Matrix2d S = P_.topLeftCorner<2, 2>() + R;
  const Eigen::Matrix<double, 3, 2> K = P_.leftCols<2>() * S.inverse();
  const Eigen::Vector2d innovation(segment.rho - state_(0),
                                   angle_difference(segment.theta, state_(1)));
  state_ += K * innovation;
  state_(1) = angle_difference(state_(1), 0);
  const Eigen::Matrix3d P = P_ - K * S * K.transpose();
  P_ = 0.5 * (P + P.transpose());
}

Plane PlaneFilter::plane() const {
  const Eigen::Vector3d N(-std::cos(state_(1)), -std::sin(state_(1)), -state_(2));
  return Plane(N, -state_(0));
}

}  // namespace lamina
