// --calibration: what a file states of sensors, laid over what the recording says of them.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <lamina/models/warning.hpp>
#include <lamina/sensors/calibration.hpp>

namespace lamina {

class YamlSection;

/// "0.01 m", for readers of what states none.
std::string default_range_sigma();

/// Warning "mounting_assumed" of a recording with odometry: `sensor` was placed at the body's
/// origin; `why` nothing says where it sits.
Warning place_assumed(const std::string& sensor, const std::string& why);

/// A calibration.yaml that need not be whole. Only what it states counts; the rest stays as the
/// recording has it.
class CalibrationOverlay {
 public:
  CalibrationOverlay();  ///< states nothing
  /// Throws lamina::Error naming file, line and key, unknown keys with the nearest known one.
  explicit CalibrationOverlay(const std::filesystem::path& file);
  /// The same for an option that may be absent.
  explicit CalibrationOverlay(const std::optional<std::filesystem::path>& file);
  ~CalibrationOverlay();
  CalibrationOverlay(CalibrationOverlay&&) noexcept;
  CalibrationOverlay& operator=(CalibrationOverlay&&) noexcept;

  /// "lidar", or "lidar.T_body_lidar".
  bool states(const std::string& key) const;
  void apply(LidarModel& lidar) const;
  /// A new model, focal length, baseline or disparity sigma changes the noise with it.
  void apply(DepthCamera& depth) const;
  void apply(StereoCamera& stereo) const;
  void apply(OdometryModel& odometry) const;
  /// All of them; sensors that the calibration does not have stay away.
  void apply(Calibration& calibration) const;

 private:
  std::unique_ptr<YamlSection> root_;
};

}  // namespace lamina
