// Interpolated increments with the covariance of the path between them.
#include <lamina/frontend/motion/wheel_odometry.hpp>

#include <algorithm>

#include <lamina/sensors/odometry_track.hpp>

namespace lamina {
namespace {

// Covariance of T_a_c = T_a_b T_b_c in its right tangent, from those of the two parts.
Matrix6d compose(const Matrix6d& cov_ab, const SE3& T_b_c, const Matrix6d& cov_bc) {
  const Matrix6d J = T_b_c.inverse().adjoint();
  return J * cov_ab * J.transpose() + cov_bc;
}

// Counters count on while nobody reads them: what they differ by is the motion. The way was longer
// than it seems, and where the ends lie in time is known less well.
Matrix6d across_hole(const OdometryModel& model, const SE3& T) {
  constexpr double kMetres = 0.03, kRadians = 0.03, kLonger = 4;  // 1-sigma; times the variance
  Matrix6d covariance = kLonger * increment_covariance(model, T);
  for (const int k : {0, 1}) covariance(k, k) += kMetres * kMetres;
  covariance(5, 5) += kRadians * kRadians;
  return covariance;
}

// That the body stood still at an end of the samples, the two there tell.
bool stood(const Odometry& end, const Odometry& inner) {
  constexpr double kMetres = 1e-3, kRadians = 1e-3;
  const SE3 moved = inner.T_odom_body.inverse() * end.T_odom_body;
  return moved.translation().norm() <= kMetres && moved.so3().log().norm() <= kRadians;
}

}  // namespace

void WheelTrack::add(const Odometry& odometry) {
  if (!samples_.empty() && odometry.stamp <= samples_.back().stamp) return;
  if (!samples_.empty()) {
    constexpr double kSmoothing = 0.1, kMost = 2;  // of an interval; times the usual one
    const double interval = odometry.stamp - samples_.back().stamp;
    usual_ += usual_ > 0 ? kSmoothing * (std::min(interval, kMost * usual_) - usual_) : interval;
  }
  const SE3& T = odometry.T_odom_body;
  moved_ = moved_ ||
           (!samples_.empty() && (T.translation() != samples_.back().T_odom_body.translation() ||
                                  T.so3().quaternion().coeffs() !=
                                      samples_.back().T_odom_body.so3().quaternion().coeffs()));
  samples_.push_back(odometry);
}

// Readers that give odometry at scans alone leave no hole between slow scans.
bool WheelTrack::hole(const Odometry& before, const Odometry& after) const {
  if (after.restarted) return true;
  constexpr double kLong = 1, kUnusual = 4;  // s; times the usual interval
  return is_hole(before.T_odom_body, after.T_odom_body, after.stamp - before.stamp,
                 std::max(kLong, kUnusual * usual_));
}

std::optional<SE3> WheelTrack::at(Timestamp stamp) const {
  if (samples_.empty()) return std::nullopt;
  const auto after =
      std::lower_bound(samples_.begin(), samples_.end(), stamp,
                       [](const Odometry& sample, Timestamp time) { return sample.stamp < time; });
  const std::size_t count = samples_.size();
  if (after == samples_.end()) {
    const bool near = stamp - samples_.back().stamp <= kMaxGap;
    if (!near || count < 2 || !stood(samples_.back(), samples_[count - 2])) return std::nullopt;
    return samples_.back().T_odom_body;
  }
  if (after->stamp == stamp) return after->T_odom_body;
  if (after == samples_.begin()) {
    const bool near = after->stamp - stamp <= kMaxGap;
    if (!near || count < 2 || !stood(samples_[0], samples_[1])) return std::nullopt;
    return after->T_odom_body;
  }
  const auto before = after - 1;
  if (hole(*before, *after)) return std::nullopt;
  return SE3::interpolate(before->T_odom_body, after->T_odom_body,
                          (stamp - before->stamp) / (after->stamp - before->stamp));
}

std::optional<Increment> WheelTrack::between(Timestamp from, Timestamp to) const {
  const auto start = at(from), end = at(to);
  if (!start || !end || restarted_within(from, to)) return std::nullopt;
  Increment sum{SE3(), Matrix6d::Zero()};
  Odometry last{from, *start};
  const auto step = [&](const Odometry& next) {
    const SE3 T = last.T_odom_body.inverse() * next.T_odom_body;
    sum.covariance =
        compose(sum.covariance, T,
                hole(last, next) ? across_hole(model_, T) : increment_covariance(model_, T));
    sum.T_from_to = sum.T_from_to * T;
    last = next;
  };
  for (auto next = first_after(from); next != samples_.end() && next->stamp < to; ++next)
    step(*next);
  step({to, *end});
  // No robot: a frame that was set anew, a counter that ran over.
  constexpr double kFarthest = 50, kFastest = 50;  // m, m/s
  if (!(sum.T_from_to.translation().norm() < kFarthest + kFastest * (to - from))) {
    return std::nullopt;
  }
  return sum;
}

std::optional<Vector6d> WheelTrack::velocity(Timestamp from, Timestamp to) const {
  if (samples_.size() < 2 || !(from < to)) return std::nullopt;
  const double late = std::max(0.0, to - newest());
  const Timestamp begin = std::max(samples_.front().stamp, from + -late), end = to + -late;
  if (late > kMaxGap || !(begin < end)) return std::nullopt;
  const auto T_begin = at(begin), T_end = at(end);
  if (!T_begin || !T_end || restarted_within(begin, end)) return std::nullopt;  // in a hole
  return Vector6d((T_begin->inverse() * *T_end).log() / (end - begin));
}

std::deque<Odometry>::const_iterator WheelTrack::first_after(Timestamp stamp) const {
  return std::upper_bound(
      samples_.begin(), samples_.end(), stamp,
      [](Timestamp time, const Odometry& sample) { return time < sample.stamp; });
}

bool WheelTrack::restarted_within(Timestamp from, Timestamp to) const {
  const auto end = first_after(to);
  return std::any_of(first_after(from), std::max(end, first_after(from)),
                     [](const Odometry& sample) { return sample.restarted; });
}

bool WheelTrack::several_within(Timestamp from, Timestamp to) const {
  auto next = first_after(from);
  int count = 0;
  while (count < 2 && next != samples_.end() && next->stamp < to) ++next, ++count;
  return count > 1;
}

void WheelTrack::forget_before(Timestamp stamp) {
  while (samples_.size() > 2 && samples_[1].stamp <= stamp) samples_.pop_front();
}

}  // namespace lamina
