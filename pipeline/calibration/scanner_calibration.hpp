// What a scanner's description has wrong, found by its turns and ways against the wheels'.
#pragma once

#include <functional>
#include <optional>

#include <lamina/models/diagnostics.hpp>
#include <lamina/pipeline/calibration/calibration_options.hpp>
#include <lamina/pipeline/calibration/scanner_check.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

/// A first look over the scans of a level scanner on wheels; nullopt where its description stands.
/// `recording` is used up.
std::optional<ScannerCheck::Found> check_scanner(Recording& recording,
                                                 const CalibrationOptions& settings,
                                                 const std::function<bool()>& ended);

/// A second look: each change of the beams' order lies where two scans in turn differ least with
/// the second reversed. `recording` is used up.
void place_changes(Recording& recording, const CalibrationOptions& settings,
                   ScannerCheck::Found& found, const std::function<bool()>& ended);

/// A warning, and an entry under `calibration`. `adopted`: scans are corrected by it.
void report_scanner(const ScannerCheck::Found& found, const Calibration& stated, bool adopted,
                    Diagnostics& metrics);

}  // namespace lamina
