// ROS 2 recordings as a recording.
#include <lamina/sensors/readers/bag_recording.hpp>
#include <lamina/sensors/readers/recording_sources.hpp>
#include <lamina/sensors/ros2/bag_storage.hpp>
#include <lamina/sensors/ros2/ros2_source.hpp>

namespace lamina {

std::unique_ptr<bag::Source> open_ros2_messages(const std::filesystem::path& path) {
  return ros2::make_source(ros2::open_storage(path));
}

std::unique_ptr<Recording> open_ros2(const std::filesystem::path& path,
                                     const RecordingOptions& options) {
  return std::make_unique<BagRecording>(path.string(), open_ros2_messages(path), options);
}

}  // namespace lamina
