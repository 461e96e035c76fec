// A bounded map by time.
#include <lamina/pipeline/publish/odometry_poses.hpp>

#include <iterator>

namespace lamina::publish {

void OdometryPoses::add(Timestamp stamp, const SE3& T_odom_body) {
  const std::lock_guard lock(mutex_);
  poses_[stamp] = T_odom_body;
  if (poses_.size() > options_.most) poses_.erase(poses_.begin());
}

std::optional<SE3> OdometryPoses::at(Timestamp stamp) const {
  const std::lock_guard lock(mutex_);
  const auto after = poses_.lower_bound(stamp);
  if (after != poses_.end() && after->first == stamp) return after->second;
  if (after != poses_.end() && after != poses_.begin()) {
    const auto before = std::prev(after);
    const double span = after->first - before->first;
    return SE3::interpolate(before->second, after->second, (stamp - before->first) / span);
  }
  if (poses_.empty()) return std::nullopt;
  const auto end = after == poses_.end() ? std::prev(after) : after;
  if (std::abs(stamp - end->first) > options_.near) return std::nullopt;
  return end->second;
}

}  // namespace lamina::publish
