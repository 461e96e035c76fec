// Pieces of the way, and a Kalman filter of three states over them.
#include <lamina/frontend/motion/wheel_bias_filter.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/frontend/motion/wheel_piece.hpp>
#include <lamina/sensors/wheel_error_model.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kScale = 0.05, kDrift = 0.5 * kDegree, kTurnScale = 0.05;  // at first, 1-sigma
constexpr double kWalk = 0.01;       // of those sigmas, a piece
constexpr double kScanTurn = 0.004;  // rad: of a piece's two ends by scans
constexpr double kLeastTurn = 0.1;   // rad of a piece: less is its noise
constexpr double kGate = 3;          // sigmas

Eigen::Vector3d first_sigmas() { return {kScale, kDrift, kTurnScale}; }

}  // namespace

WheelLearning::WheelLearning(bool enabled)
    : covariance_(first_sigmas().cwiseAbs2().asDiagonal()), enabled_(enabled) {}

void WheelLearning::begin(double scale, double sigma) {
  errors_(0) = scale;
  covariance_(0, 0) = sigma * sigma;
  scale_known_ = true;
}

void WheelLearning::add(Timestamp stamp, const std::optional<Increment>& by_wheels,
                        const std::optional<SE3>& by_scans) {
  if (!enabled_) return;
  if (by_wheels && by_scans) {
    piece_.add(by_wheels->T_from_to, *by_scans);
    noise_ += by_wheels->covariance;
    if (!is_whole(piece_)) return;
    compare(stamp);
  }
  piece_ = {};
  noise_.setZero();
}

void WheelLearning::compare(Timestamp stamp) {
  const auto block =
      static_cast<std::int64_t>(std::floor(stamp.seconds() / AdoptionOptions().block_s));
  if (block != block_) {
    if (scale_gain_) scale_gains_.add(*scale_gain_);
    if (turn_gain_) turn_gains_.add(*turn_gain_);
    scale_gain_.reset();
    turn_gain_.reset();
    block_ = block;
  }
  covariance_.diagonal() += (kWalk * first_sigmas()).cwiseAbs2();
  const double yaw = piece_.scans.so3().yaw();
  const double turned = std::remainder(yaw - piece_.wheels.so3().yaw(), 2 * M_PI);
  const double turn = std::abs(yaw) < kLeastTurn ? 0 : yaw;
  turn_gain_ =
      turn_gain_.value_or(0) +
      update(turned, std::hypot(std::sqrt(noise_(5, 5)), kScanTurn), {0, piece_.way, turn});
  const auto lengths = lengths_of(piece_);
  if (!lengths) return;
  scale_gain_ = scale_gain_.value_or(0) + update(lengths->scans - lengths->wheels,
                                                 std::hypot(std::sqrt(noise_(0, 0)), kScanShift),
                                                 {lengths->wheels, 0, 0});
}

double WheelLearning::update(double value, double sigma, const Eigen::Vector3d& gradient) {
  const Eigen::Vector3d PH = covariance_ * gradient;
  const double variance = gradient.dot(PH) + sigma * sigma;
  const double innovation = value - gradient.dot(errors_);
  const auto cost = [sigma](double off) {
    return std::min(kTruncated, off * off / (sigma * sigma));
  };
  const double gain = cost(value) - cost(innovation);
  if (innovation * innovation > kGate * kGate * variance) return gain;
  errors_ += PH * (innovation / variance);
  covariance_ -= PH * PH.transpose() / variance;
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
  return gain;
}

// 1 for errors that are taken out, 0 for the others.
Eigen::Vector3d WheelLearning::used() const {
  const bool scale = scale_known_ || scale_adoption().adopted;
  const bool turns = turn_adoption().adopted;
  return {scale ? 1.0 : 0.0, turns ? 1.0 : 0.0, turns ? 1.0 : 0.0};
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

}  // namespace lamina
