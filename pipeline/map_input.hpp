// What is mapped: a recording that is opened as often as it takes, put right as far as is known.
#pragma once

#include <functional>
#include <memory>

#include <lamina/pipeline/calibration/camera/camera_checks.hpp>
#include <lamina/pipeline/calibration/odometry_units.hpp>
#include <lamina/pipeline/map_options.hpp>
#include <lamina/pipeline/run_observer.hpp>
#include <lamina/sensors/reclocked_recording.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sensors/recording_source.hpp>
#include <lamina/sensors/scan_correction.hpp>

namespace lamina {

class MapInput {
 public:
  /// Opens the recording, checks its cameras, its odometry's units and the camera's clock.
  MapInput(const RecordingSource& source, const MapOptions& options, const RunObserver& observer);

  bool live() const { return source_.live; }
  bool offline() const { return !options.online && !live(); }
  /// From its beginning, with what was found wrong put right, on corrected clocks; counted in
  /// `readings`.
  std::unique_ptr<Recording> open_again() { return open_reclocked(clocks); }
  std::unique_ptr<Recording> open_reclocked(const ClockOffsets& offsets);
  /// What was found so far.
  void note(Diagnostics& diagnostics) const;

  MapOptions options;  ///< with what the checks leave of them
  std::unique_ptr<Recording> recording;
  Calibration sensors;
  ClockOffsets clocks;
  ScanCorrection scanner;
  CameraFindings cameras;
  std::int64_t readings = 0;  ///< how often the recording was opened to be read

 private:
  std::unique_ptr<Recording> open() const { return open_in(units_); }
  std::unique_ptr<Recording> open_in(const OdometryUnits& units) const;
  void check(const std::function<bool()>& ended);

  const RecordingSource& source_;
  OdometryUnits units_;
};

}  // namespace lamina
