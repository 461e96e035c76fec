// What is learned of a recording's sensors before it is mapped.
#pragma once

#include <functional>
#include <memory>

#include <lamina/frontend/frontend.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/pipeline/calibration/calibration_options.hpp>
#include <lamina/pipeline/calibration/time_offset.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sensors/scan_correction.hpp>

namespace lamina {

/// A recording that can be read again and again. Some players bear no other beside them: it is let
/// go of before it is opened anew.
struct Rereadable {
  std::unique_ptr<Recording>& recording;
  const std::function<std::unique_ptr<Recording>()>& open_again;  ///< its clocks corrected
  const OpenReclocked& open_reclocked;
  ClockOffsets& clocks;     ///< to be corrected
  ScanCorrection& scanner;  ///< likewise; what it holds is in what is opened from then on
  const CalibrationOptions& settings;
  Diagnostics& metrics;
  std::function<bool()> ended;
};

/// Looks over the recording for the bend and slopes of depth images, a scanner's sweep, its lean,
/// the clocks of both, and the wheels' scale, as far as settings ask for them, and tells the
/// front-end. The recording is at its beginning afterwards.
void self_calibrate(const Rereadable& input, FrontEnd& front_end);

}  // namespace lamina
