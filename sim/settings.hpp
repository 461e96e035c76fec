// Named numbers a world is made from: defaults, overrides, and which keys there are.
#pragma once

#include <set>
#include <string>

#include <lamina/sim/world.hpp>

namespace lamina::sim {

/// Hands out overrides by key and remembers which keys were asked for, so that finish() can name
/// those nobody knows.
class Settings {
 public:
  Settings(std::string scene, const Parameters& parameters)
      : scene_(std::move(scene)), parameters_(parameters) {}
  double number(const std::string& key, double fallback);
  int integer(const std::string& key, int fallback);
  /// on/off, true/false, yes/no, 1/0.
  bool flag(const std::string& key, bool fallback);
  /// One of `choices`.
  std::string choice(const std::string& key, const std::string& fallback,
                     const std::vector<std::string>& choices);
  /// Whether the caller set it.
  bool given(const std::string& key) const { return parameters_.count(key) > 0; }
  /// Throws lamina::Error when a parameter was given that nobody asked for.
  void finish() const;
  const std::set<std::string>& known() const { return known_; }

 private:
  const std::string* find(const std::string& key);
  void require_in_range(const std::string& key, double value) const;

  std::string scene_;
  const Parameters& parameters_;
  std::set<std::string> known_;
};

/// "key=value" each; throws lamina::Error for another form.
Parameters parse_parameters(const std::vector<std::string>& assignments);

/// The candidate with the least edit distance to `word`; empty when none is near.
std::string nearest_name(const std::string& word, const std::vector<std::string>& candidates);

/// What a built-in world starts its rig from; every number can be overridden.
struct RigDefaults {
  bool depth = true, stereo = false, lidar = false, odometry = true, accelerometer = false;
  double camera_height = 0.8, camera_forward = 0, camera_pitch_deg = 25, camera_rate = 5;
  std::string camera_model = "kinect";
  double lidar_height = 0.3, lidar_pitch_deg = 0, lidar_roll_deg = 0, lidar_yaw_deg = 0;
  double lidar_fov_deg = 270, lidar_range = 30, lidar_rate = 10, lidar_sigma = 0.01;
  int lidar_beams = 541;
  double odometry_rate = 20, odometry_sigma = 0.02, odometry_rotation = 0.02;
  double odometry_scale = 1, odometry_drift_deg = 0;
  bool planar = true;
};

/// Rig from defaults and the keys camera.*, effects.*, stereo.*, lidar.*, odometry.*,
/// accelerometer.*, calibration.* (docs/simulator.md).
Rig make_rig(Settings& settings, const RigDefaults& defaults);

}  // namespace lamina::sim
