// A body that stands tilted where a recording begins: on the edge of a carpet, a sill, a cable.
#pragma once

#include <optional>
#include <vector>

#include <lamina/frontend/depth/leveling.hpp>

namespace lamina {

/// How a camera is mounted by most of a recording, and how its first floors seem to say it is. One
/// frame cannot tell a body's tilt from its camera's; where the way goes on otherwise it can.
struct TiltedStart {
  SE3 T_body_camera;  ///< as calibrated: what both are against
  Leveling usual;     ///< of most of the way: the mounting
  Leveling start;     ///< of the first floors
  /// How tilted the body stood: the body's frame in one levelled by its first floor (z = 0, origin
  /// above (0, 0), heading kept).
  SE3 T_level_body() const;
};

/// Hears what the floor of each image says of the mounting, in order of time.
class StartWatch {
 public:
  explicit StartWatch(const SE3& T_body_camera_calibrated)
      : T_body_camera_(T_body_camera_calibrated) {}
  /// `way`: driven since the start, m.
  void add(const Leveling& leveling, double way);
  /// The start seems tilted, or it is not known yet: more of the way may tell. False soon where
  /// floors further on look like the first ones.
  bool wants_more() const { return state_ != State::kUsual; }
  /// The start is over: what comes is asked only how the camera is mounted usually.
  bool past_start() const { return state_ == State::kTilted; }
  /// Where the first floors are off by more than 0.8 deg from what more than half of the places
  /// further on agree on (to 0.5 deg), and fewer than a quarter of them look like the first: a
  /// camera that is knocked later, ground that is uneven all over, or a ramp that is seen for long
  /// do not pass.
  std::optional<TiltedStart> result() const;

 private:
  enum class State { kUnknown, kUsual, kTilted };
  SE3 T_body_camera_;
  State state_ = State::kUnknown;
  std::vector<Leveling> start_, later_;  // within the start's way; beyond it, a place each
  double last_way_ = 0;
};

}  // namespace lamina
