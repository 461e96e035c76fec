// A build without what messages of ROS 2 need.
#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/recording_sources.hpp>
#include <lamina/sensors/ros2/live_source.hpp>

namespace lamina {

int ros2::live_domain(const std::string&) { return 0; }

std::unique_ptr<Recording> ros2::open_live(const std::string& input, const RecordingOptions&,
                                           const LiveOptions&) {
  throw input_error(input, "", "a kind this build cannot read",
                    "a build with libsqlite3-dev, liblz4-dev, libfastcdr-dev and cyclonedds-dev");
}

std::unique_ptr<Recording> open_ros2_live(const std::string& input,
                                          const RecordingOptions& options) {
  return ros2::open_live(input, options, {});
}

}  // namespace lamina
