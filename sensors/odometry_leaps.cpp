// One step after the other against those before.
#include <lamina/models/median.hpp>
#include <lamina/sensors/odometry_leaps.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

double turn_of(const SE3& T) { return T.so3().log().norm(); }

bool at_origin(const SE3& T, double near) {
  return T.translation().norm() < near && turn_of(T) < near;
}

}  // namespace

bool OdometryLeaps::leapt(const SE3& moved, double dt, bool to_origin) const {
  if (steps_.size() < 2) return false;
  double way = 0, turn = 0;
  std::vector<double> intervals;
  for (const Step& step : steps_) {
    way = std::max(way, step.way);
    turn = std::max(turn, step.turn);
    intervals.push_back(step.dt);
  }
  const double time = std::max(dt, median(intervals));  // stamps may bunch
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

Odometry OdometryLeaps::add(const Odometry& measured) {
  const SE3& T = measured.T_odom_body;
  Odometry result = measured;
  if (!last_) {
    last_ = measured;
    return result;
  }
  const double dt = measured.stamp - last_->stamp;
  SE3 moved = last_->T_odom_body.inverse() * T;
  if (dt > 0) {
    const bool to_origin =
        at_origin(T, options_.restart) && !at_origin(last_->T_odom_body, options_.restart);
    if (in_a_row_ < options_.most_in_a_row && leapt(moved, dt, to_origin)) {
      in_a_row_ += measured.interpolated ? 0 : 1;
      if (leaps_.empty() || measured.stamp - leaps_.back().stamp > options_.near)
        leaps_.push_back({measured.stamp, 0, 0, false});
      Leap& leap = leaps_.back();
      leap.stamp = std::min(leap.stamp, measured.stamp);
      leap.metres += moved.translation().norm();
      leap.radians += turn_of(moved);
      leap.to_origin = leap.to_origin || to_origin;
      moved = SE3::exp(std::min(dt, options_.longest) * velocity_);
      T_first_now_ = T_first_now_ * last_->T_odom_body * moved * T.inverse();
    } else {
      in_a_row_ = 0;
      velocity_ = moved.log() / dt;
      steps_.push_back({moved.translation().norm(), turn_of(moved), dt});
      if (steps_.size() > options_.memory) steps_.pop_front();
    }
    last_ = measured;
  }
  if (!leaps_.empty()) result.T_odom_body = T_first_now_ * T;
  return result;
}

}  // namespace lamina
