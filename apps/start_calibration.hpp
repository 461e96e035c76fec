// A look over a recording for a body that stands tilted where it begins.
#pragma once

#include <functional>
#include <optional>

#include <lamina/apps/wheel_track.hpp>
#include <lamina/frontend/floor/depth_distortion.hpp>
#include <lamina/frontend/floor/floor_options.hpp>
#include <lamina/frontend/floor/tilted_start.hpp>
#include <lamina/io/metrics.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina::apps {

/// What StartWatch makes of the floors in the images of the first 2 m and, only where the start
/// seems tilted, of some 100 more over the rest of the way. `wheels`: all of the recording's
/// odometry. nullopt, too, where wheels are not those of a body that stands on a floor, or `ended`
/// asks to stop. `recording` is used up.
std::optional<TiltedStart> find_tilted_start(Recording& recording, const WheelTrack& wheels,
                                             const FloorOptions& options,
                                             const DepthDistortion& distortion,
                                             const std::function<bool()>& ended);

/// Says how the body stands at first, in the log and in metrics.json.
void tell_start(const TiltedStart& start, io::Metrics& metrics);

}  // namespace lamina::apps
