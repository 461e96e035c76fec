// A first look over images where turns begin and end: are they of the time their stamps say?
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include <lamina/models/diagnostics.hpp>
#include <lamina/models/warning.hpp>
#include <lamina/pipeline/calibration/calibration_options.hpp>
#include <lamina/sensors/reclocked_recording.hpp>

namespace lamina {

/// Turns of a camera's images beside those of planar wheels (TurnClaims): some hundred images at
/// most, fewer where they turn as the wheels do. Stamps that are off are corrected in `clocks`, or
/// only said (`clocks.find` of `settings`): where a camera alone stands beside wheels its stamps
/// are when its poses are asked for, right or not, and the odometry's move. Motion is not asked of
/// images that were smeared. What was found is added to `warnings`. `ended` asks to stop.
void look_at_camera_clock(const std::function<std::unique_ptr<Recording>()>& open,
                          const Calibration& sensors, ClockOffsets& clocks,
                          CalibrationOptions& settings, std::vector<Warning>& warnings,
                          const std::function<bool()>& ended);

/// What clocks were corrected by beyond what settings say of them, among the counts.
void note_clocks(const ClockOffsets& clocks, const CalibrationOptions& settings,
                 Diagnostics& metrics);

}  // namespace lamina
