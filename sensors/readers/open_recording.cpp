// Chooses the reader for an input.
#include <lamina/sensors/recording.hpp>

#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/bag_sink.hpp>
#include <lamina/sensors/readers/compressed_text.hpp>
#include <lamina/sensors/readers/input_kind.hpp>
#include <lamina/sensors/readers/recording_sources.hpp>
#include <lamina/sensors/surface_pixels.hpp>

namespace lamina {
namespace {
bool holds_clouds(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (ending_of(entry.path()) == ".pcd") return true;
  }
  return false;
}

#if !LAMINA_HAVE_MRPT || !LAMINA_HAVE_ROSBAG || !LAMINA_HAVE_ROS2 || !LAMINA_HAVE_OPENNI || \
    !LAMINA_HAVE_PCL
[[noreturn]] void fail_without(const std::string& input, const char* library) {
  throw input_error(input, "", "a kind this build cannot read",
                    std::string("a build with ") + library);
}
#endif
}  // namespace

#if !LAMINA_HAVE_MRPT
std::unique_ptr<Recording> open_rawlog(const std::filesystem::path& file, const RecordingOptions&) {
  fail_without(file.string(), "libmrpt-obs-dev");
}
#endif
#if !LAMINA_HAVE_ROSBAG
std::unique_ptr<bag::Sink> bag::make_ros1_sink(const std::string& file) {
  fail_without(file, "librosbag-storage-dev");
}
std::unique_ptr<Recording> open_rosbag(const std::filesystem::path& file, const RecordingOptions&) {
  fail_without(file.string(), "librosbag-storage-dev");
}
std::unique_ptr<bag::Source> open_rosbag_messages(const std::string& name) {
  fail_without(name, "librosbag-storage-dev");
}
#endif
#if !LAMINA_HAVE_ROS2
std::unique_ptr<bag::Sink> bag::make_ros2_sink(const std::string& folder, const std::string&) {
  fail_without(folder, "libsqlite3-dev, liblz4-dev and libfastcdr-dev");
}
std::unique_ptr<Recording> open_ros2(const std::filesystem::path& path, const RecordingOptions&) {
  fail_without(path.string(), "libsqlite3-dev, liblz4-dev and libfastcdr-dev");
}
std::unique_ptr<bag::Source> open_ros2_messages(const std::filesystem::path& path) {
  fail_without(path.string(), "libsqlite3-dev, liblz4-dev and libfastcdr-dev");
}
#endif
#if !LAMINA_HAVE_OPENNI
std::unique_ptr<Recording> open_openni(const std::string& uri, bool, const RecordingOptions&) {
  fail_without(uri.empty() ? "openni:" : uri, "libopenni2-dev");
}
#endif
#if !LAMINA_HAVE_PCL
std::unique_ptr<Recording> open_pcd(const std::filesystem::path& path, const RecordingOptions&) {
  fail_without(path.string(), "libpcl-dev");
}
#endif

namespace {
std::unique_ptr<Recording> open_folder(const std::filesystem::path& path,
                                       const RecordingOptions& options) {
  std::error_code error;
  const bool dataset = std::filesystem::exists(path / "calibration.yaml", error);
  if (!dataset && holds_clouds(path)) return open_pcd(path, options);
  if (!dataset && is_ros2(path)) return open_ros2(path, options);
  const std::string extension = ending_of(path);
  if (extension == ".oni" || extension == ".log" || extension == ".clf" || extension == ".rawlog" ||
      extension == ".bag" || extension == ".pcd") {
    throw input_error(path.string(), "", "a folder", "a " + extension + " file");
  }
  return open_dataset_folder(path, options);
}

std::unique_ptr<Recording> as_it_is(const std::string& input, const RecordingOptions& options) {
  const std::string device = "openni:";
  if (input.compare(0, device.size(), device) == 0) {
    return open_openni(input.substr(device.size()), false, options);
  }
  if (input.rfind("ros2:", 0) == 0) return open_ros2_live(input, options);
  const std::filesystem::path path(input);
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    throw input_error(input, "", "no such file or folder", kInputKinds);
  }
  const std::string extension = ending_of(path);
  if (std::filesystem::is_directory(path, error)) {
    return open_folder(path, options);
  }
  if (!std::filesystem::is_regular_file(path, error)) {
    throw input_error(input, "", "a pipe or a device",
                      "a file, which is read more than once: write it to one first");
  }
  if (std::filesystem::is_empty(path, error) && !error) {
    throw input_error(input, "", "an empty file", "a recording");
  }
  if (extension == ".log" || extension == ".clf") return open_carmen_log(path, options);
  if (path.extension() == ".rawlog") return open_rawlog(path, options);
  if (extension == ".db3" || extension == ".mcap") return open_ros2(path, options);
  if (compression_of(path) == Compression::kNone) {
    if (extension == ".oni") return open_openni(input, true, options);
    if (extension == ".rawlog") return open_rawlog(path, options);
    if (extension == ".bag") return open_rosbag(path, options);
    if (extension == ".pcd") return open_pcd(path, options);
    if (is_ros2(path)) return open_ros2(path, options);
  }
  if (const auto kind = kind_of_input(path); !kind.found.empty() && !seems_carmen(path)) {
    throw input_error(input, "", kind.found, kind.advice);
  }
  if (seems_carmen(path)) return open_carmen_log(path, options);
  throw input_error(input, "",
                    extension.empty() ? "a file of no known kind" : "a " + extension + " file",
                    kInputKinds);
}
}  // namespace

std::unique_ptr<Recording> open_recording(const std::string& input,
                                          const RecordingOptions& options) {
  return std::make_unique<SurfacesRecording>(as_it_is(input, options));
}

}  // namespace lamina
