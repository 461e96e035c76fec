// Bags written: messages as plain structs go to files of ROS 1 or ROS 2.
#pragma once

#include <memory>
#include <string>

#include <lamina/sensors/readers/bag_messages.hpp>

namespace lamina::bag {

/// Takes messages of kinds kScan, kDepth (as 16UC1), kCameraInfo, kOdometry, kTransform and kImu,
/// in the order of their recording.
class Sink {
 public:
  Sink() = default;
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;
  virtual ~Sink() = default;
  /// `message.topic` is where it goes; the time of recording is its stamp, but `log_ns` where that
  /// is not 0. Throws lamina::Error when it cannot be written.
  virtual void write(const Message& message, std::int64_t log_ns = 0) = 0;
  /// Once, at the end: before, the file is not whole.
  virtual void close() = 0;
};

/// A ROS 1 bag, version 2.0. Throws std::runtime_error with the library's reason.
std::unique_ptr<Sink> make_ros1_sink(const std::string& file);
/// A ROS 2 recording of one file, "db3" or "mcap" (Zstandard): a folder with metadata.yaml. Throws
/// lamina::Error.
std::unique_ptr<Sink> make_ros2_sink(const std::string& folder, const std::string& storage);

}  // namespace lamina::bag
