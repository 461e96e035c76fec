// `lamina map`: a recording in, a map out.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <lamina/apps/settings.hpp>
#include <lamina/sensors/calibration.hpp>

namespace lamina::apps {

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
  bool quiet = false;
  std::optional<std::string> live;  ///< [ADDRESS:]PORT of the page to look on, empty: the default
};

/// Settings of a request: defaults, the preset, then the file, then --set, --seed, --threads. Where
/// the request names no preset, `sensors` choose it (null: none yet). Throws lamina::Error for the
/// first problem.
Settings settings_of(const MapRequest& request, const Calibration* sensors = nullptr);

/// Log lines to stderr; warnings only when quiet.
void set_up_log(bool quiet);

/// Maps, writes everything, prints a summary on stdout. Returns the exit code.
int run_map(const MapRequest& request);

}  // namespace lamina::apps
