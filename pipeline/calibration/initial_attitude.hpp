// A look over a recording for a body that stands tilted where it begins.
#pragma once

#include <functional>
#include <optional>

#include <lamina/frontend/depth/depth_distortion.hpp>
#include <lamina/frontend/depth/floor_options.hpp>
#include <lamina/frontend/depth/tilted_start.hpp>
#include <lamina/frontend/motion/wheel_odometry.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

/// What StartWatch makes of the floors in the images of the first 2 m and, only where the start
/// seems tilted, of some 100 more over the rest of the way. `wheels`: all of the recording's
/// odometry. nullopt, too, where wheels are not those of a body that stands on a floor, or `ended`
/// asks to stop. `recording` is used up.
std::optional<TiltedStart> find_tilted_start(Recording& recording, const WheelTrack& wheels,
                                             const FloorOptions& options,
                                             const DepthDistortion& distortion,
                                             const std::function<bool()>& ended);

/// Says how the body stands at first, in the log and in metrics.json.
void tell_start(const TiltedStart& start, Diagnostics& metrics);

}  // namespace lamina
