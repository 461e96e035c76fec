// A first look over a recording's depth images, for what all of them share.
#pragma once

#include <functional>
#include <optional>

#include <lamina/frontend/depth/depth_distortion.hpp>
#include <lamina/frontend/depth/floor_options.hpp>
#include <lamina/frontend/depth/leveling.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

/// What some 120 images share, spread over the recording.
struct DepthCalibration {
  DepthDistortion bend;  ///< as planes show it; empty where they show none
  /// How the camera is mounted, against its calibration, where that is so wrong in tilt and height
  /// that no image shows a floor where it should be, and the floors seen instead agree.
  std::optional<Leveling> mounting;
  /// How uneven the ground is: 1-sigma of one image's floor, by the median change from one floor to
  /// the next, so that a knock or a ramp counts once. nullopt for fewer than ten floors.
  std::optional<Leveling> ground;
};

/// Looks over the recording (over its first 1,200 images where the source cannot say how many it
/// has); nothing is found where `ended` asks to stop. What was found goes to the log and to the
/// counts of `metrics`. `recording` is used up.
DepthCalibration calibrate_depth(Recording& recording, const FloorOptions& options,
                                 Diagnostics& metrics, const std::function<bool()>& ended);

}  // namespace lamina
