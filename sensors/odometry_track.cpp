// Interpolates odometry.
#include <lamina/sensors/odometry_track.hpp>

#include <algorithm>

#include <lamina/models/median.hpp>
#include <lamina/sensors/stamp_series.hpp>
#include <lamina/sensors/time_order.hpp>

namespace lamina {

bool is_hole(const SE3& before, const SE3& after, double silence, double long_silence) {
  constexpr double kMetres = 0.05, kRadians = 0.05;
  if (!(silence > long_silence)) return false;
  const SE3 moved = before.inverse() * after;
  return moved.translation().norm() > kMetres || moved.so3().log().norm() > kRadians;
}

void go_on_over_steps(std::vector<Odometry>& samples) {
  std::vector<std::optional<Timestamp>> stamps;
  for (const Odometry& sample : samples) stamps.emplace_back(sample.stamp);
  const auto series = ordered_stamps(stamps);
  if (!series || series->steps.empty()) return;
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i].stamp = series->stamps[i];
}

OdometryTrack::OdometryTrack(std::span<const Odometry> samples) {
  std::vector<Timestamp> stamps;
  stamps.reserve(samples.size());
  for (const Odometry& sample : samples) stamps.push_back(sample.stamp);
  for (const std::size_t i : longest_increasing(stamps)) {
    track_.add(samples[i].stamp, samples[i].T_odom_body);
  }
  dropped_ = samples.size() - track_.size();
  std::vector<double> intervals;
  for (std::size_t i = 1; i < track_.size(); ++i)
    intervals.push_back(track_[i].stamp - track_[i - 1].stamp);
  if (intervals.empty()) return;
  interval_ = median(intervals);
}

// The usual interval is that of some twenty, without holes.
bool OdometryTrack::add(const Odometry& sample) {
  if (!track_.empty() && sample.stamp <= track_.back().stamp) {
    ++dropped_;
    return false;
  }
  if (!track_.empty()) {
    const double passed = sample.stamp - track_.back().stamp;
    if (interval_ == 0) interval_ = passed;
    if (passed < kHole * interval_) interval_ += (passed - interval_) / 20;
  }
  track_.add(sample.stamp, sample.T_odom_body);
  return true;
}

std::vector<Timestamp> OdometryTrack::stamps() const {
  std::vector<Timestamp> stamps;
  for (const StampedPose& sample : track_) stamps.push_back(sample.stamp);
  return stamps;
}

std::optional<Odometry> OdometryTrack::at(Timestamp stamp) const {
  if (track_.empty()) return std::nullopt;
  const auto poses = track_.poses();
  const auto next = static_cast<std::size_t>(
      std::lower_bound(poses.begin(), poses.end(), stamp,
                       [](const StampedPose& sample, Timestamp t) { return sample.stamp < t; }) -
      poses.begin());
  if (next < poses.size() && poses[next].stamp == stamp) return Odometry{stamp, poses[next].pose};
  if (next == 0) return carried(stamp, 0, +1);
  if (next == poses.size()) return carried(stamp, next - 1, -1);
  const StampedPose &before = poses[next - 1], &after = poses[next];
  if (!is_hole(before.pose, after.pose, after.stamp - before.stamp,
               std::max(1.0, kHole * interval_))) {
    return Odometry{stamp, *track_.at(stamp), true};
  }
  // The ends of a hole are ends.
  const bool early = stamp - before.stamp < after.stamp - stamp;
  return early ? carried(stamp, next - 1, -1) : carried(stamp, next, +1);
}

// The motion between the sample `end` and its neighbour inwards, carried on to a stamp outside.
std::optional<Odometry> OdometryTrack::carried(Timestamp stamp, std::size_t end,
                                               std::ptrdiff_t inwards) const {
  const StampedPose& last = track_[end];
  const double beyond = std::abs(stamp - last.stamp);
  const double longest = track_.size() < 2
                             ? kLongestExtrapolation
                             : std::min(kLongestExtrapolation, kExtrapolated * interval_);
  if (beyond > longest) return std::nullopt;
  const std::ptrdiff_t neighbour = static_cast<std::ptrdiff_t>(end) + inwards;
  const auto size = static_cast<std::ptrdiff_t>(track_.size());
  if (neighbour < 0 || neighbour >= size) return Odometry{stamp, last.pose, true};
  const StampedPose& inner = track_[static_cast<std::size_t>(neighbour)];
  const double span = std::abs(last.stamp - inner.stamp);
  const bool hole = is_hole(inner.pose, last.pose, span, std::max(1.0, kHole * interval_));
  if (hole) return Odometry{stamp, last.pose, true};
  return Odometry{stamp, SE3::interpolate(inner.pose, last.pose, 1 + beyond / span), true};
}

}  // namespace lamina
