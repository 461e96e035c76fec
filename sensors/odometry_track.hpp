// Odometry of a whole recording, asked for at the times of other sensors.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <lamina/models/trajectory.hpp>
#include <lamina/sensors/odometry.hpp>

namespace lamina {

/// A silence (s) longer than `long_silence` in which the body went 5 cm or 3 degrees: by which way
/// is not known.
bool is_hole(const SE3& before, const SE3& after, double silence, double long_silence = 1);

/// Builds the track from samples in any order; those whose time goes back are left out and counted.
class OdometryTrack {
 public:
  OdometryTrack() = default;
  explicit OdometryTrack(std::span<const Odometry> samples);

  bool empty() const { return track_.empty(); }
  const Trajectory& trajectory() const { return track_; }
  /// Of its samples.
  std::vector<Timestamp> stamps() const;
  std::size_t dropped() const { return dropped_; }
  /// On the geodesic between the two samples around `stamp`. For kExtrapolated usual intervals
  /// between samples, and no more than kLongestExtrapolation seconds, before the first or after the
  /// last the end's motion is carried on; nullopt further out. nullopt, too, in a hole: samples
  /// kHole usual intervals and more than a second apart, between which the body moved by 5 cm or
  /// 3 degrees, say nothing of the way.
  std::optional<Odometry> at(Timestamp stamp) const;

  static constexpr double kExtrapolated = 1.5;
  static constexpr double kLongestExtrapolation = 0.5;  // s
  static constexpr double kHole = 5;

 private:
  Trajectory track_;
  double interval_ = 0;  // s, median
  std::size_t dropped_ = 0;
};

}  // namespace lamina
