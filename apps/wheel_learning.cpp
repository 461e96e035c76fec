// Pieces of the way, and a Kalman filter of three states over them.
#include <lamina/apps/wheel_learning.hpp>

#include <Eigen/LU>
#include <cmath>

#include <lamina/apps/wheel_piece.hpp>
#include <lamina/backend/wheel_errors.hpp>

namespace lamina::apps {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kScale = 0.05, kDrift = 0.5 * kDegree, kTurnScale = 0.05;  // at first, 1-sigma
constexpr double kWalk = 0.01;                          // of those sigmas, a piece
constexpr double kScanTurn = 0.004;                     // rad: of a piece's two ends by scans
constexpr double kLeastTurn = 0.1;                      // rad of a piece: less is its noise
constexpr double kGate = 3;                             // sigmas
constexpr double kStandsOut = 16, kAloneStandsOut = 9;  // chi-squared of 3 dof, of one

Eigen::Vector3d first_sigmas() { return {kScale, kDrift, kTurnScale}; }

}  // namespace

WheelLearning::WheelLearning() : covariance_(first_sigmas().cwiseAbs2().asDiagonal()) {}

void WheelLearning::begin(double scale, double sigma) {
  errors_(0) = scale;
  covariance_(0, 0) = sigma * sigma;
  scale_known_ = true;
}

void WheelLearning::add(const std::optional<Increment>& by_wheels,
                        const std::optional<SE3>& by_scans) {
  if (by_wheels && by_scans) {
    piece_.add(by_wheels->T_from_to, *by_scans);
    noise_ += by_wheels->covariance;
    if (!is_whole(piece_)) return;
    compare();
  }
  piece_ = {};
  noise_.setZero();
}

void WheelLearning::compare() {
  covariance_.diagonal() += (kWalk * first_sigmas()).cwiseAbs2();
  const double yaw = piece_.scans.so3().yaw();
  const double turned = std::remainder(yaw - piece_.wheels.so3().yaw(), 2 * M_PI);
  const double turn = std::abs(yaw) < kLeastTurn ? 0 : yaw;
  hear(turned, std::hypot(std::sqrt(noise_(5, 5)), kScanTurn), {0, piece_.way, turn});
  const auto lengths = lengths_of(piece_);
  if (!lengths) return;
  hear(lengths->scans - lengths->wheels, std::hypot(std::sqrt(noise_(0, 0)), kScanShift),
       {lengths->wheels, 0, 0});
}

void WheelLearning::hear(double value, double sigma, const Eigen::Vector3d& gradient) {
  const Eigen::Vector3d PH = covariance_ * gradient;
  const double variance = gradient.dot(PH) + sigma * sigma;
  const double innovation = value - gradient.dot(errors_);
  if (innovation * innovation > kGate * kGate * variance) return;
  errors_ += PH * (innovation / variance);
  covariance_ -= PH * PH.transpose() / variance;
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
}

// 1 for errors that are taken out, 0 for the others.
Eigen::Vector3d WheelLearning::used() const {
  const bool all = errors_.dot(covariance_.inverse() * errors_) >= kStandsOut;
  const bool alone = errors_(0) * errors_(0) >= kAloneStandsOut * covariance_(0, 0);
  return {all || alone || scale_known_ ? 1.0 : 0.0, all ? 1.0 : 0.0, all ? 1.0 : 0.0};
}

Eigen::Vector3d WheelLearning::left() const {
  const Eigen::Vector3d stay = (1 - used().array()) * errors_.array();
  return (covariance_.diagonal() + stay.cwiseAbs2()).cwiseSqrt();
}

Increment WheelLearning::corrected(const Increment& by_wheels) const {
  const Eigen::Vector3d used = this->used();
  if (used.isZero()) return by_wheels;
  const SE3& T = by_wheels.T_from_to;
  const double way = T.translation().norm(), yaw = T.so3().yaw();
  const Eigen::Vector3d turning(0, used(1) * way, used(2) * yaw);
  const Eigen::Vector3d e = used.cwiseProduct(errors_);
  const WheelErrors::Vector errors = WheelErrors::of(e(0), e(1), e(2));
  Increment result{lamina::corrected(T, errors), by_wheels.covariance};
  const Eigen::Vector3d along = used(0) * std::sqrt(covariance_(0, 0)) * T.translation();
  result.covariance.topLeftCorner<3, 3>() += along * along.transpose();
  result.covariance(5, 5) += turning.dot(covariance_ * turning);
  return result;
}

}  // namespace lamina::apps
