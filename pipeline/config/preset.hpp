// Presets: settings for a kind of recording, chosen by what it holds.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <lamina/pipeline/config/settings.hpp>
#include <lamina/sensors/calibration.hpp>

namespace lamina {

struct Preset {
  std::string name, purpose;
  /// Key and value, where they differ from the defaults.
  std::vector<std::pair<std::string, std::string>> values;
};

/// indoor_rgbd, wheeled_lidar and aerial_lidar.
const std::vector<Preset>& presets();

/// What suits the sensors: a scanner that hangs or leans by more than `max_tilt` (rad) is carried
/// by an aircraft; a level one drives; without any, cameras look at rooms.
const Preset& preset_for(const Calibration& calibration, double max_tilt);
/// By name; nullptr when there is none of it.
const Preset* find_preset(const std::string& name);
/// Sets its values and `MapOptions::preset`.
void apply(const Preset& preset, MapOptions& settings);

}  // namespace lamina
