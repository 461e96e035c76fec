// A map and everything that its run knows of it.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/models/planar_map.hpp>
#include <lamina/pipeline/build_grid.hpp>
#include <lamina/pipeline/map_options.hpp>
#include <lamina/pipeline/run_record.hpp>
#include <lamina/sensors/reclocked_recording.hpp>

namespace lamina {

struct MapResult {
  std::string recording;              ///< its name
  MapOptions options;                 ///< as they were in force
  Mapper mapper;                      ///< the graph, to be asked or to go on with
  std::shared_ptr<RunRecord> record;  ///< evidence of the steps, figures, warnings
  PlanarMap map{};                    ///< planes, surfels, points; what moved is taken out
  /// T_map_body at the stamps of the map's steps (`clocks`, `restamped`: the recording's own).
  Trajectory trajectory{};
  std::optional<Grids> grids{};  ///< none: stopped before they were drawn
  /// With what self-calibration adopted; none: saved sessions, which have no sensors.
  std::optional<Calibration> calibration{};
  std::vector<std::string> notes{};  ///< lines for people: what of the recording was skipped first
  std::vector<std::filesystem::path> sessions{};  ///< files that the map was made of, if any
  bool stopped = false;   ///< ended early: the map is of a part, or lacks its grids
  ClockOffsets clocks{};  ///< what corrected the stamps
  std::map<Timestamp, Timestamp>
      restamped{};  ///< stamps of the map -> of the recording, where others

  Diagnostics& diagnostics() { return record->diagnostics; }
  const Diagnostics& diagnostics() const { return record->diagnostics; }
};

/// Of `map` and `trajectory` as the mapper has them: what moved is taken out, figures are counted,
/// grids are drawn as far as there is time.
void finish_map(MapResult& result, RunObserver& observer);

/// A path as the recording counts time.
Trajectory at_recorded_stamps(const Trajectory& trajectory, const MapResult& result);

}  // namespace lamina
