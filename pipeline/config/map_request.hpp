// What a user asks of a map, in files and texts, and the options of it.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <lamina/pipeline/map_options.hpp>
#include <lamina/sensors/calibration.hpp>
#include <lamina/sensors/recording_source.hpp>

namespace lamina {

struct MapRequest {
  std::string input;
  std::filesystem::path output;
  std::optional<std::filesystem::path> config;
  std::optional<std::filesystem::path> calibration;  ///< laid over what the input says of sensors
  std::optional<std::string> preset;     ///< by name; else the file's, else by the sensors
  std::vector<std::string> assignments;  ///< key=value
  bool online = false;                   ///< false: offline, the whole graph is refined at the end
  std::optional<int> seed, threads;
  bool resume = false;
  std::function<bool()> ended = [] { return false; };  ///< a live source is to end
};

/// A device or a running robot: read once, while it lasts.
bool is_live(const std::string& input);

/// Options of a request: defaults, the preset, then the file, then --set, --seed, --threads. Where
/// the request names no preset, `sensors` choose it (null: none yet). Throws lamina::Error for the
/// first problem.
MapOptions options_of(const MapRequest& request, const Calibration* sensors = nullptr);

/// The recording of a request, and the options of its run: by its sensors, with scratch files and
/// checkpoint in the output folder. A running robot is mapped online.
struct Requested {
  RecordingSource source;
  MapOptions options;
};
Requested requested(const MapRequest& request);

/// Options that suit these sensors: what `lamina map` takes without a word of its user.
MapOptions preset_options(const Calibration& sensors);

}  // namespace lamina
