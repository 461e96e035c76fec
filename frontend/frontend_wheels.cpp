// What wheels say of the way, less what is known to be wrong with them.
#include <cmath>

#include <lamina/frontend/frontend.hpp>

namespace lamina {

void FrontEnd::look_by_scans(const FrontEnd& other) {
  level_scanner_ = other.level_scanner_;
  sweep_ = other.sweep_;
  wheels_ahead_ = other.wheels_ahead_;
  scans_tell_scale_ = true;
}

// Logs without odometry often hold one of zeros: wheels that never moved are no longer asked once
// scans tell of a way.
std::optional<Increment> FrontEnd::measured_way(const std::optional<Timestamp>& from,
                                                Timestamp to) const {
  if (last_scan_ && !wheels_.moved()) {
    constexpr double kWay = 0.2;  // m, or rad
    const SE3 way = first_step_->inverse() * T_start_scan_body_;
    if (way.translation().norm() > kWay || way.so3().log().norm() > kWay) return std::nullopt;
  }
  return from ? wheels_.between(*from, to) : std::nullopt;
}

// Counters go on across a hole: from the last step that they met, whatever was guessed since. Where
// wheels tell the way from the last step, that is none.
std::optional<Increment> FrontEnd::across_hole(const SE3& T_start_from, Timestamp to) const {
  if (!met_last_ || met_last_->steps == 0 || !wheels_.moved()) return std::nullopt;
  const auto moved = without_systematic_errors(wheels_.between(met_last_->stamp, to));
  if (!moved) return std::nullopt;
  const SE3 T = T_start_from.inverse() * met_last_->T_start_body * moved->T_from_to;
  return Increment{T, moved->covariance + met_last_->since};
}

void FrontEnd::note_met(Timestamp stamp, const Increment& increment) {
  if (wheels_.at(stamp)) {
    met_last_ = Met{stamp, T_start_body_};
  } else if (met_last_) {
    const Matrix6d J = increment.T_from_to.inverse().adjoint();
    met_last_->since = J * met_last_->since * J.transpose() + increment.covariance;
    ++met_last_->steps;
  }
}

// The same less what was learned of their lawful errors.
std::optional<Increment> FrontEnd::driven(const std::optional<Timestamp>& from,
                                          Timestamp to) const {
  return without_systematic_errors(measured_way(from, to));
}

std::optional<Increment> FrontEnd::without_systematic_errors(
    const std::optional<Increment>& measured) const {
  return measured && planar_ ? learned_.corrected(*measured) : measured;
}

// Wheels as a start for scans, not sure of their scale. In the local map, of length L, an error of
// scale is the same in every step: it displaces scans by scale L, as steps t of independent noise
// do with a variance of scale^2 L |t| each.
Matrix6d FrontEnd::of_unknown_scale(const Increment& wheels) const {
  constexpr double kScale = 0.05;
  const ScanOdometryOptions& options = scan_odometry_.options();
  const double length = options.key_scans * options.key_translation;
  Matrix6d covariance = wheels.covariance;
  const Eigen::Vector3d& t = wheels.T_from_to.translation();
  if (const double way = t.norm(); way > 0)
    covariance.topLeftCorner<3, 3>() += kScale * kScale * length / way * t * t.transpose();
  return covariance;
}

}  // namespace lamina
