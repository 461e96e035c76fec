// Interpolates odometry.
#include <lamina/sensors/odometry_track.hpp>

#include <algorithm>

#include <lamina/sensors/time_order.hpp>

namespace lamina {

bool is_hole(const SE3& before, const SE3& after, double silence, double long_silence) {
  constexpr double kMetres = 0.05, kRadians = 0.05;
  if (!(silence > long_silence)) return false;
  const SE3 moved = before.inverse() * after;
  return moved.translation().norm() > kMetres || moved.so3().log().norm() > kRadians;
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
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  interval_ = *middle;
}

std::vector<Timestamp> OdometryTrack::stamps() const {
  std::vector<Timestamp> stamps;
  for (const StampedPose& sample : track_) stamps.push_back(sample.stamp);
  return stamps;
}

std::optional<Odometry> OdometryTrack::at(Timestamp stamp) const {
  if (track_.empty()) return std::nullopt;
  if (const auto pose = track_.at(stamp)) {
    const auto same =
        std::lower_bound(track_.begin(), track_.end(), stamp,
                         [](const StampedPose& sample, Timestamp t) { return sample.stamp < t; });
    if (same != track_.end() && same->stamp != stamp &&
        is_hole((same - 1)->pose, same->pose, same->stamp - (same - 1)->stamp,
                std::max(1.0, kHole * interval_))) {
      return std::nullopt;
    }
    return Odometry{stamp, *pose, same == track_.end() || same->stamp != stamp};
  }
  const bool before = stamp < track_.front().stamp;
  const StampedPose& end = before ? track_.front() : track_.back();
  const double beyond = before ? end.stamp - stamp : stamp - end.stamp;
  const double longest = track_.size() < 2
                             ? kLongestExtrapolation
                             : std::min(kLongestExtrapolation, kExtrapolated * interval_);
  if (beyond > longest) return std::nullopt;
  if (track_.size() < 2) return Odometry{stamp, end.pose, true};
  const StampedPose& inner = before ? track_[1] : track_[track_.size() - 2];
  const double span = before ? inner.stamp - end.stamp : end.stamp - inner.stamp;
  return Odometry{stamp, SE3::interpolate(inner.pose, end.pose, 1 + beyond / span), true};
}

}  // namespace lamina
