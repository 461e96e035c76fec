// Unwraps and interpolates.
#include <lamina/pipeline/calibration/turn_track.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/frontend/motion/planar.hpp>

namespace lamina {

void TurnTrack::add(Timestamp stamp, const SE3& T_odom_body) {
  const double yaw = T_odom_body.so3().yaw();
  if (samples_.empty()) {
    samples_.push_back({stamp, yaw});
  } else if (stamp > samples_.back().stamp) {
    const double last = samples_.back().yaw;
    samples_.push_back({stamp, last + wrap_angle(yaw - last)});
  }
}

std::optional<double> TurnTrack::at(Timestamp stamp) const {
  constexpr double kSilence = 0.3, kTurned = 0.02;  // s, rad
  const auto after = std::lower_bound(samples_.begin(), samples_.end(), stamp,
                                      [](const Sample& s, Timestamp t) { return s.stamp < t; });
  if (after == samples_.end()) return std::nullopt;
  if (after->stamp == stamp) return after->yaw;
  if (after == samples_.begin()) return std::nullopt;
  const Sample& before = *(after - 1);
  const double dt = after->stamp - before.stamp, turned = after->yaw - before.yaw;
  if (dt > kSilence && std::abs(turned) > kTurned) return std::nullopt;
  return before.yaw + turned * ((stamp - before.stamp) / dt);
}

std::optional<double> TurnTrack::rate(Timestamp from, Timestamp to) const {
  const auto start = at(from), end = at(to);
  if (!start || !end || !(from < to)) return std::nullopt;
  return (*end - *start) / (to - from);
}

}  // namespace lamina
