// One step after the other against those before.
#include <lamina/models/median.hpp>
#include <lamina/sensors/odometry_leaps.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace lamina {
namespace {

double turn_of(const SE3& T) { return T.so3().log().norm(); }

bool at_origin(const SE3& T, double near) {
  return T.translation().norm() < near && turn_of(T) < near;
}

bool begins_again(const SE3& before, const SE3& now, double near) {
  return at_origin(now, near) && !at_origin(before, near);
}

bool same(const SE3& a, const SE3& b) {
  return a.translation() == b.translation() &&
         a.so3().quaternion().coeffs() == b.so3().quaternion().coeffs();
}

}  // namespace

double OdometryLeaps::usual_interval() const {
  std::vector<double> intervals;
  for (const Step& step : steps_) {
    if (step.interval > 0) intervals.push_back(step.interval);
  }
  return intervals.empty() ? 0 : median(intervals);
}

bool OdometryLeaps::leapt(const SE3& moved, double time, bool to_origin) const {
  if (steps_.size() < 2) return false;
  double way = 0, turn = 0;
  for (const Step& step : steps_) {
    way = std::max(way, step.way);
    turn = std::max(turn, step.turn);
  }
  const double gathering = std::min(time, options_.longest);
  const double speed = velocity_.head<3>().norm() + 0.5 * options_.acceleration * gathering;
  const double rate = velocity_.tail<3>().norm() + 0.5 * options_.spin * gathering;
  // A counter that stands at zero again needs less of a proof.
  const double share = to_origin ? 0.3 : 1;
  const bool far = moved.translation().norm() >
                   share * std::max(options_.slack + speed * time, options_.usual * way);
  const bool round =
      turn_of(moved) > share * std::max(options_.turn_slack + rate * time, options_.usual * turn);
  return far || (round && turn_of(moved) < M_PI);
}

double OdometryLeaps::counts_every() const {
  const bool mostly = 2 * static_cast<std::int64_t>(counts_.size()) > changes_;
  return mostly && changes_ >= 10 ? median(counts_) : 0;
}

SE3 OdometryLeaps::take_leap(const Odometry& measured, const SE3& moved, bool to_origin) {
  in_a_row_ += measured.interpolated ? 0 : 1;
  if (leaps_.empty() || measured.stamp - leaps_.back().stamp > options_.near)
    leaps_.push_back({measured.stamp, 0, 0, false});
  Leap& leap = leaps_.back();
  leap.stamp = std::min(leap.stamp, measured.stamp);
  leap.metres += moved.translation().norm();
  leap.radians += turn_of(moved);
  leap.to_origin = leap.to_origin || to_origin;
  return SE3::exp(std::min(measured.stamp - last_->stamp, options_.longest) * velocity_);
}

Odometry OdometryLeaps::add(const Odometry& measured) {
  const SE3& T = measured.T_odom_body;
  Odometry result = measured;
  if (!last_) {
    last_ = measured;
    changed_ = counted_ = measured.stamp;
    return result;
  }
  const double dt = measured.stamp - last_->stamp;
  const bool repeats = same(T, last_->T_odom_body);
  if (repeats && !measured.interpolated) ++repeats_;
  const SE3 moved = last_->T_odom_body.inverse() * T;
  if (dt > 0 && !repeats) {
    const double usual = usual_interval();
    const bool to_origin = begins_again(last_->T_odom_body, T, options_.restart);
    const bool hole = dt > std::max(options_.longest, options_.hole * usual);
    const bool restarted = hole && to_origin && steps_.size() >= 2;
    // Stamps may bunch, and counters may be read more often than they count.
    if (restarted ||
        (in_a_row_ < options_.most_in_a_row && leapt(moved, std::max(dt, usual), to_origin))) {
      T_first_now_ =
          T_first_now_ * last_->T_odom_body * take_leap(measured, moved, to_origin) * T.inverse();
      result.restarted = hole;
    } else {
      in_a_row_ = 0;
      velocity_ = moved.log() / (measured.stamp - changed_);
      const double interval = measured.interpolated ? 0 : measured.stamp - counted_;
      changes_ += measured.interpolated ? 0 : 1;
      if (interval > options_.slow && repeats_ >= options_.slower) counts_.push_back(interval);
      steps_.push_back({moved.translation().norm(), turn_of(moved), interval});
      if (steps_.size() > options_.memory) steps_.pop_front();
    }
    changed_ = measured.stamp;
    if (!measured.interpolated) counted_ = measured.stamp;
    repeats_ = 0;
  }
  if (dt > 0) last_ = measured;
  if (!leaps_.empty()) result.T_odom_body = T_first_now_ * T;
  return result;
}

}  // namespace lamina
