// Where measurements come from: opened as often as a run reads them.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <lamina/sensors/recording.hpp>

namespace lamina {

struct RecordingSource {
  std::string name;  ///< in messages and results
  /// From its beginning, each time the same. Throws lamina::Error.
  std::function<std::unique_ptr<Recording>()> open;
  bool live = false;  ///< a device: read once, while it lasts
  /// Frames of odometry and body, as a running robot has them.
  std::string odometry_frame = "odom", body_frame = "base_link";
};

}  // namespace lamina
