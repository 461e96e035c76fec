// Motions by wheels, across holes, too.
#include <lamina/frontend/motion/wheel_motion.hpp>

#include <algorithm>

namespace lamina {

// Odometry that ends before the first frame, or begins after the last, is none.
void WheelMotion::meet(Timestamp stamp, std::optional<Timestamp> from) {
  met_ = met_ || track_.at(stamp).has_value();
  if (!from) return;
  if (last_met_) from = std::min(*from, last_met_->stamp);
  track_.forget_before(*from);
}

std::optional<Increment> WheelMotion::across_hole(const SE3& T_start_from, Timestamp to) const {
  if (!last_met_ || last_met_->steps == 0 || !track_.moved()) return std::nullopt;
  const auto moved = corrected(track_.between(last_met_->stamp, to));
  if (!moved) return std::nullopt;
  const SE3 T = T_start_from.inverse() * last_met_->T_start_body * moved->T_from_to;
  return Increment{T, moved->covariance + last_met_->since};
}

void WheelMotion::placed(Timestamp stamp, const SE3& T_start_body, const Increment& increment) {
  if (track_.at(stamp)) {
    last_met_ = LastMet{stamp, T_start_body};
  } else if (last_met_) {
    const Matrix6d J = increment.T_from_to.inverse().adjoint();
    last_met_->since = J * last_met_->since * J.transpose() + increment.covariance;
    ++last_met_->steps;
  }
}

}  // namespace lamina
