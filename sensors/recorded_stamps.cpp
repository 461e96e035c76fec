// Interpolation, and constant motion beyond the ends.
#include <lamina/sensors/recorded_stamps.hpp>

#include <algorithm>
#include <vector>

namespace lamina {
namespace {

constexpr double kCarried = 0.2;  // s of motion at an end that goes on

// The pose of the end, moved on as from `inner`, some way before it, to the end.
SE3 carried_on(const StampedPose& inner, const StampedPose& end, Timestamp stamp) {
  const double share = (stamp - inner.stamp) / (end.stamp - inner.stamp);
  return SE3::interpolate(inner.pose, end.pose, share);
}

SE3 pose_at(const Trajectory& trajectory, Timestamp stamp) {
  if (const auto pose = trajectory.at(stamp)) return *pose;
  const auto poses = trajectory.poses();
  const bool before = stamp < trajectory.front().stamp;
  const StampedPose& end = before ? trajectory.front() : trajectory.back();
  const auto far = [&](const StampedPose& p) { return std::abs(p.stamp - end.stamp) >= kCarried; };
  if (before) {
    const auto inner = std::find_if(poses.begin(), poses.end(), far);
    return inner == poses.end() ? end.pose : carried_on(*inner, end, stamp);
  }
  const auto inner = std::find_if(poses.rbegin(), poses.rend(), far);
  return inner == poses.rend() ? end.pose : carried_on(*inner, end, stamp);
}

}  // namespace

Trajectory at_recorded_stamps(const Trajectory& trajectory, const ClockOffsets& clocks,
                              const std::set<Timestamp>& scans) {
  if (clocks.scanner == 0 && clocks.camera == 0) return trajectory;
  std::vector<Timestamp> stamps;
  for (const StampedPose& p : trajectory) {
    stamps.push_back(p.stamp + -(scans.count(p.stamp) > 0 ? clocks.scanner : clocks.camera));
  }
  std::sort(stamps.begin(), stamps.end());
  Trajectory result;
  for (const Timestamp stamp : stamps) result.add(stamp, pose_at(trajectory, stamp));
  return result;
}

}  // namespace lamina
