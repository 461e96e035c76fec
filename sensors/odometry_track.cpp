// Interpolates odometry.
#include <lamina/sensors/odometry_track.hpp>

#include <algorithm>

#include <lamina/sensors/time_order.hpp>

namespace lamina {

OdometryTrack::OdometryTrack(std::span<const Odometry> samples) {
  std::vector<Timestamp> stamps;
  stamps.reserve(samples.size());
  for (const Odometry& sample : samples) stamps.push_back(sample.stamp);
  for (const std::size_t i : longest_increasing(stamps)) {
    track_.add(samples[i].stamp, samples[i].T_odom_body);
  }
  dropped_ = samples.size() - track_.size();
}

std::optional<Odometry> OdometryTrack::at(Timestamp stamp) const {
  if (track_.empty()) return std::nullopt;
  if (const auto pose = track_.at(stamp)) {
    const auto same =
        std::lower_bound(track_.begin(), track_.end(), stamp,
                         [](const StampedPose& sample, Timestamp t) { return sample.stamp < t; });
    return Odometry{stamp, *pose, same == track_.end() || same->stamp != stamp};
  }
  const bool before = stamp < track_.front().stamp;
  const StampedPose& end = before ? track_.front() : track_.back();
  const double beyond = before ? end.stamp - stamp : stamp - end.stamp;
  if (beyond > kLongestExtrapolation) return std::nullopt;
  if (track_.size() < 2) return Odometry{stamp, end.pose, true};
  const StampedPose& inner = before ? track_[1] : track_[track_.size() - 2];
  const double span = before ? inner.stamp - end.stamp : end.stamp - inner.stamp;
  return Odometry{stamp, SE3::interpolate(inner.pose, end.pose, 1 + beyond / span), true};
}

}  // namespace lamina
