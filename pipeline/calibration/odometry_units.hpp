// A first look over images where wheels and images move: is the odometry in metres and radians?
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include <lamina/models/warning.hpp>
#include <lamina/pipeline/calibration/calibration_options.hpp>
#include <lamina/sensors/odometry_units.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

/// The recording with its odometry in these units.
using OpenInUnits = std::function<std::unique_ptr<Recording>(const OdometryUnits&)>;

/// Motions of a camera's images beside those of planar wheels, over the first forty pieces of way.
/// Where these contradict each other the odometry is tried in millimetres, centimetres, inches,
/// feet and degrees, and in units that nobody knows, each scored by the same cost (options of
/// ScannerCheck): min(e' S^-1 e, most_cost) a piece, e what the images' motion is off the wheels'.
/// What explains it clearly is returned and added to `warnings` (`wheel_scale`). The identity
/// where nothing does, or wheels are not to be corrected (`wheels.calibrate` of `settings`).
OdometryUnits look_at_odometry_units(const OpenInUnits& open, const CalibrationOptions& settings,
                                     std::vector<Warning>& warnings,
                                     const std::function<bool()>& ended);

}  // namespace lamina
