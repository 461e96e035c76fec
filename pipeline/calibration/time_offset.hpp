// Clocks of scanner and camera against the odometry's, told before the map is made.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include <lamina/frontend/depth/depth_distortion.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/pipeline/calibration/calibration_options.hpp>
#include <lamina/pipeline/calibration/clock_offset.hpp>
#include <lamina/sensors/reclocked_recording.hpp>

namespace lamina {

/// Opens the recording with its stamps corrected by what is given.
using OpenReclocked = std::function<std::unique_ptr<Recording>(const ClockOffsets&)>;

struct FoundClocks {
  std::optional<ClockOffset::Result> scanner, camera;  ///< what stands out
  /// What the first look told, whether or not it stands out from the odometry's clock.
  std::optional<ClockOffset::Result> scanner_observed{}, camera_observed{};
  double odometry_interval = 0;  ///< s, mean
};

/// Looks over the recording: how far the body turned between scans of a level scanner, as matching
/// alone has it, and between depth images, against planar odometry (ClockOffset). What stands out
/// is looked at once more with stamps so corrected, and left if another offset stands out then: it
/// is not constant. `sweep`: of scans that do not say. For recordings of planar odometry.
FoundClocks find_clocks(const OpenReclocked& open, const CalibrationOptions& settings,
                        const std::optional<double>& sweep, const DepthDistortion& distortion,
                        const std::function<bool()>& ended);

/// Offsets of scanner and camera from the odometry's clock as offsets from the earliest of the
/// clocks: no stamp is put before what it says was measured. Scanner and camera that agree are
/// right and the odometry is late. Of a sensor without a found offset the stamps are right, too,
/// unless it told that they go with the odometry's.
ClockOffsets by_earliest(const FoundClocks& found);

/// Where a scanner alone stands beside wheels its stamps are when its poses are asked for, right or
/// not: the odometry's move.
ClockOffsets by_scanner(const FoundClocks& found);

/// find_clocks() on top of what `clocks` corrects already, by_earliest() or without a depth camera
/// by_scanner() (what is longer than from one odometry to the next), told in the log and among the
/// counts of `metrics`. False where nothing was to do.
bool correct_clocks(ClockOffsets& clocks, const OpenReclocked& open,
                    const CalibrationOptions& settings, const std::optional<double>& sweep,
                    const DepthDistortion& distortion, Diagnostics& metrics,
                    const std::function<bool()>& ended);

}  // namespace lamina
