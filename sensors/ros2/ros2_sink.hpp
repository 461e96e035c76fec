// ROS 2 recordings written from plain structs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include <lamina/sensors/readers/bag_sink.hpp>
#include <lamina/sensors/ros2/record_writer.hpp>

namespace lamina::ros2 {

struct SinkOptions {
  std::string storage = "mcap";  ///< "mcap" or "db3"
  McapWriterOptions mcap;
  std::int64_t messages_per_file = 0;  ///< splits of the recording; 0: one file
  bool big_endian = false;
};

/// A folder with metadata.yaml and NAME_0.mcap (or .db3), NAME_1..., named as the folder is. Throws
/// lamina::Error when it cannot be written.
std::unique_ptr<bag::Sink> make_sink(const std::filesystem::path& folder,
                                     const SinkOptions& options = {});

}  // namespace lamina::ros2
