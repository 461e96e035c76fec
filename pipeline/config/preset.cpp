// The presets' values, and which one suits a recording.
#include <lamina/pipeline/config/preset.hpp>

#include <cmath>

#include <lamina/models/error.hpp>

namespace lamina {

const std::vector<Preset>& presets() {
  static const std::vector<Preset> all = {
      {"indoor_rgbd", "a depth or stereo camera in rooms: the defaults", {}},
      {"wheeled_lidar", "a robot with a level 2D scanner, with or without a camera", {}},
      {"aerial_lidar",
       "a scanner that hangs from an aircraft or leans",
       // Scan lines are metres apart and cross a surface few times: a track counts from its first
       // sighting.
       {{"tracking.min_observations", "1"}}},
  };
  return all;
}

const Preset* find_preset(const std::string& name) {
  for (const Preset& preset : presets()) {
    if (preset.name == name) return &preset;
  }
  return nullptr;
}

const Preset& preset_for(const Calibration& calibration, double max_tilt) {
  const char* name = "indoor_rgbd";
  if (calibration.lidar) {
    const SO3& R_body_lidar = calibration.lidar->T_body_lidar.so3();
    const double up = std::abs((R_body_lidar * Eigen::Vector3d::UnitZ()).z());
    name = up < std::cos(max_tilt) ? "aerial_lidar" : "wheeled_lidar";
  }
  const Preset* preset = find_preset(name);
  LAMINA_CHECK(preset != nullptr);
  return *preset;
}

void apply(const Preset& preset, MapOptions& settings) {
  settings.preset = preset.name;
  for (const auto& [key, value] : preset.values) set(settings, key, value, "preset");
}

}  // namespace lamina
