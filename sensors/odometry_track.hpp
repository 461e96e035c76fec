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

/// A clock that was set back while the recorder ran on: times go on where they stood.
void go_on_over_steps(std::vector<Odometry>& samples);

/// Builds the track from samples in any order; those whose time goes back are left out and counted.
class OdometryTrack {
 public:
  OdometryTrack() = default;
  explicit OdometryTrack(std::span<const Odometry> samples);

  /// One more sample while it is recorded; false where its time goes back (counted).
  bool add(const Odometry& sample);
  bool empty() const { return track_.empty(); }
  const Trajectory& trajectory() const { return track_; }
  /// Of its samples.
  std::vector<Timestamp> stamps() const;
  std::size_t dropped() const { return dropped_; }
  /// On the geodesic between the two samples around `stamp`. For kExtrapolated usual intervals
  /// between samples, and no more than kLongestExtrapolation seconds, before the first or after the
  /// last the end's motion is carried on; nullopt further out. The same at the ends of a hole:
  /// samples kHole usual intervals and more than a second apart, between which the body moved by
  /// 5 cm or 3 degrees, say nothing of the way between them; where they stand they count on.
  std::optional<Odometry> at(Timestamp stamp) const;

  static constexpr double kExtrapolated = 1.5;
  static constexpr double kLongestExtrapolation = 0.5;  // s
  static constexpr double kHole = 5;

 private:
  std::optional<Odometry> carried(Timestamp stamp, std::size_t end, std::ptrdiff_t inwards) const;

  Trajectory track_;
  double interval_ = 0;  // s, median
  std::size_t dropped_ = 0;
};

}  // namespace lamina
