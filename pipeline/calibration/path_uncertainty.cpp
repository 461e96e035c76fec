// Errors and noise carried from step to step in the body's tangent.
#include <lamina/pipeline/calibration/path_uncertainty.hpp>

#include <spdlog/spdlog.h>

#include <cmath>
#include <utility>

#include <lamina/backend/parameters/wheel_errors.hpp>
#include <lamina/pipeline/calibration/log.hpp>

namespace lamina {
namespace {

constexpr double kDelta = 1e-4;      // of an error, for differences
constexpr double kFoundAgain = 1.0;  // m
constexpr int kYaw = 5;

// The motion of a step, of wheels with errors e.
SE3 with_errors(const Step& step, const Eigen::Vector3d& e) {
  const SE3& T = step.motion.T_from_to;
  const LeftToWheels& left = step.left_to_wheels;
  const double turning = left.heading ? 1 : 0;
  const SE3 off =
      corrected(T, WheelErrors::of(left.way ? e(0) : 0, turning * e(1), turning * e(2)));
  return left.way ? off : SE3(off.so3(), T.translation());
}

// Its stated noise, ahead and in heading. Where tracking was lost the covariance is that of having
// been carried away, which is told as such.
Matrix6d noise_of(const Step& step, double moved) {
  if (step.tracking_lost) return Matrix6d::Zero();
  Vector6d along = Vector6d::Zero();
  along.head<3>() = step.motion.T_from_to.translation() / moved;
  const Matrix6d& C = step.motion.covariance;
  Matrix6d noise = Matrix6d::Zero();
  if (step.left_to_wheels.way) noise = along.dot(C * along) * along * along.transpose();
  if (step.left_to_wheels.heading) noise(kYaw, kYaw) = C(kYaw, kYaw);
  return noise;
}

}  // namespace

void WheelPath::note_stretch(const Step& step, double moved, Timestamp before) {
  if (step.left_to_wheels.way) {
    if (stretch_.way == 0) stretch_.from = before;
    stretch_.way += moved;
    stretch_.to = step.observations.stamp;
    seen_ = 0;
    if (stretch_.way > longest_.way) longest_ = stretch_;
  } else if ((seen_ += moved) > kFoundAgain) {
    stretch_ = {};
  }
}

void WheelPath::add(const Step& step) {
  const auto before = std::exchange(last_, step.observations.stamp);
  if (!before) return;
  const SE3& T = step.motion.T_from_to;
  const LeftToWheels& left = step.left_to_wheels;
  const double moved = T.translation().norm();
  note_stretch(step, moved, *before);
  const Matrix6d J = T.inverse().adjoint();
  off_ = (J * off_).eval();
  noise_ = (J * noise_ * J.transpose()).eval();
  if (moved > 0 && (left.way || left.heading)) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d d = kDelta * Eigen::Vector3d::Unit(k);
      off_.col(k) += (with_errors(step, -d).inverse() * with_errors(step, d)).log() / (2 * kDelta);
    }
    noise_ += noise_of(step, moved);
    alone_ += moved;
  }
  if (left.way) way_ += moved;
  if (step.scan_motion && step.scan_motion->wheels_slipped && step.wheels_moved)
    slipped_ +=
        (step.wheels_moved->translation() - step.scan_motion->T_prev_curr_body.translation())
            .norm();
  if (left.heading) heading_ += moved;
  held_ = left.heading ? 0 : held_ + moved;
  if (held_ > kFoundAgain) {
    off_.row(kYaw).setZero();
    noise_.row(kYaw).setZero();
    noise_.col(kYaw).setZero();
  }
  const auto place = off_.topRows<2>();
  sum_off_ += moved * place.transpose() * place;
  sum_noise_ += moved * noise_.topLeftCorner<2, 2>().trace();
  path_ += moved;
}

double WheelPath::sigma(const Eigen::Vector3d& sigmas) const {
  if (!(path_ > 0)) return 0;
  const double systematic = sigmas.cwiseMin(known_).cwiseAbs2().dot(sum_off_.diagonal());
  const double seen = path_ - way_, slip = seen > 0 ? slipped_ / seen : 0;
  return std::sqrt((systematic + slip * slip * sum_off_(0, 0) + sum_noise_) / path_);
}

void WheelPath::tell(const Eigen::Vector3d& sigmas, Diagnostics& metrics) const {
  constexpr double kSlipped = 0.5;  // m
  if (slipped_ > 0) metrics.counts.wheels_slipped_m = slipped_;
  if (slipped_ > kSlipped)
    run_log().info("scans contradicted the wheels by {:.1f} m in all, and were believed", slipped_);
  if (!(alone_ > 0)) return;
  metrics.counts.by_wheels_alone_m = alone_;
  metrics.counts.way_by_wheels_alone_m = way_;
  metrics.counts.heading_by_wheels_alone_m = heading_;
  metrics.counts.by_wheels_alone_sigma_m = sigma(sigmas);
  if (!(longest_.way > 0)) return;
  metrics.counts.way_by_wheels_alone_longest_m = longest_.way;
  metrics.counts.way_by_wheels_alone_longest_from_s = longest_.from.seconds();
  metrics.counts.way_by_wheels_alone_longest_to_s = longest_.to.seconds();
}

}  // namespace lamina
