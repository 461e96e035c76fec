// How far the body turned between depth images taken where turns begin and end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include <lamina/frontend/depth/depth_distortion.hpp>
#include <lamina/frontend/motion/scan_odometry.hpp>
#include <lamina/frontend/motion/wheel_odometry.hpp>
#include <lamina/pipeline/calibration/turn_track.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

/// The odometry of a whole recording.
struct Wheels {
  TurnTrack turns;
  WheelTrack track;
  Timestamp first, last;
  std::size_t count = 0;
  explicit Wheels(const OdometryModel& model) : track(model) {}
  void add(const Odometry& odometry);
  /// s, in the mean, from one to the next.
  double interval() const {
    return count > 1 ? (last - first) / static_cast<double>(count - 1) : 0;
  }
};

/// All of the odometry, without decoding an image for it; what was read until `ended`, or until the
/// recording cannot be read on, which the run itself comes to and says.
Wheels wheels_of(Recording& recording, const std::function<bool()>& ended);

/// The next image but `skip`, of a stereo pair where these are all there is; nullopt at the end, or
/// where the recording cannot be read on.
std::optional<DepthFrame> next_image(Recording& recording, std::int64_t skip);

/// Where matching begins, and counts for next to nothing: within 5 cm and 0.05 rad.
std::optional<MotionGuess> loose(const std::optional<Increment>& moved);

/// What an image told of the way since the one that was matched before it.
struct ImageTurn {
  Timestamp from, to;
  double yaw = 0, sigma = 0;  ///< rad, by the image alone
  bool observed = false;      ///< it follows the one before, and nothing makes it doubtful
  bool matched = false;       ///< it follows the one before, and was matched with it,
  bool explained = false;     ///< to its stated noise (DepthMotion)
};

/// Depth odometry over images within `around` (s) of which the wheels' turn rate changes; what
/// wheels say of the motion is where matching begins and counts for next to nothing. `visit` gets
/// every image that was matched and returns false to stop; so does `ended` returning true.
void turns_by_images(Recording& recording, const Wheels& wheels, const DepthDistortion& distortion,
                     double around, const std::function<bool()>& ended,
                     const std::function<bool(const ImageTurn&)>& visit);

}  // namespace lamina
