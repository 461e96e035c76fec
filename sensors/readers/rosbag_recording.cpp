// ROS 1 bags as a recording.
#include <stdexcept>

#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/bag_recording.hpp>
#include <lamina/sensors/readers/input_kind.hpp>
#include <lamina/sensors/readers/recording_sources.hpp>
#include <lamina/sensors/readers/rosbag_source.hpp>

namespace lamina {
namespace {

std::string first_line(const std::runtime_error& error) {
  const std::string why = error.what();
  return why.substr(0, why.find('\n'));
}

}  // namespace

std::unique_ptr<bag::Source> open_rosbag_messages(const std::string& name) {
  try {
    return bag::open_ros1(name);
  } catch (const std::runtime_error& error) {
    const InputKind kind = kind_of_bag(name, first_line(error));
    throw input_error(name, "", kind.found, kind.advice);
  }
}

std::unique_ptr<Recording> open_rosbag(const std::filesystem::path& file,
                                       const RecordingOptions& options) {
  const std::string name = file.string();
  try {
    return std::make_unique<BagRecording>(name, open_rosbag_messages(name), options);
  } catch (const Error&) {
    throw;
  } catch (const std::runtime_error& error) {  // the library's, about a damaged index
    throw input_error(name, "", "a damaged bag (" + first_line(error) + ")",
                      "a ROS 1 bag, version 2.0, indexed");
  }
}

}  // namespace lamina
