// Checks of the sensors before anything is mapped.
#include <lamina/pipeline/map_input.hpp>

#include <spdlog/spdlog.h>

#include <lamina/pipeline/calibration/camera/camera_time_offset.hpp>
#include <lamina/pipeline/calibration/log.hpp>
#include <lamina/pipeline/unrepeated_recording.hpp>
#include <lamina/sensors/camera_corrected_recording.hpp>
#include <lamina/sensors/corrected_recording.hpp>

namespace lamina {

MapInput::MapInput(const RecordingSource& source, const MapOptions& stated,
                   const RunObserver& observer)
    : options(stated), source_(source) {
  recording = open();
  readings = 1;
  sensors = recording->calibration();
  run_log().info("preset {}", options.preset);
  clocks = {-options.scanner_delay, -options.camera_delay, -options.odometry_delay};
  if (!live() && (sensors.depth_camera || sensors.stereo_camera))
    check([&observer] { return observer.should_stop(); });
}

std::unique_ptr<Recording> MapInput::open_in(const OdometryUnits& units) const {
  std::unique_ptr<Recording> stated = corrected(source_.open(), cameras.fixes);
  if (options.stated_scanner.any())
    stated = std::make_unique<StatedScannerRecording>(std::move(stated), options.stated_scanner);
  return std::make_unique<UnrepeatedRecording>(std::make_unique<CorrectedRecording>(
      std::move(stated), scanner, options.scan_odometry.max_tilt, units));
}

std::unique_ptr<Recording> MapInput::open_reclocked(const ClockOffsets& offsets) {
  ++readings;
  return reclocked(open(), offsets);
}

void MapInput::check(const std::function<bool()>& ended) {
  cameras = check_cameras(*recording, options.floor, ended);
  options.floor.self_calibrate = options.floor.self_calibrate && !cameras.floor_uneven;
  recording.reset();
  if (sensors.odometry.planar && !cameras.fixes.drop_depth)
    units_ = look_at_odometry_units([this](const OdometryUnits& units) { return open_in(units); },
                                    options, cameras.warnings, ended);
  look_at_camera_clock([this] { return open(); }, sensors, clocks, options, cameras.warnings,
                       ended);
  recording = open();
  sensors = recording->calibration();
}

void MapInput::note(Diagnostics& diagnostics) const {
  for (const Warning& found : cameras.warnings) diagnostics.warn(found.id, found.text);
  note_clocks(clocks, options, diagnostics);
}

}  // namespace lamina
