// Files of ROS 2 recordings, written.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace lamina::ros2 {

/// Messages as bytes, in the order of their recording.
class RecordWriter {
 public:
  RecordWriter() = default;
  RecordWriter(const RecordWriter&) = delete;
  RecordWriter& operator=(const RecordWriter&) = delete;
  virtual ~RecordWriter() = default;
  /// Numbers of topics count from 0 on, in the order of these calls.
  virtual void add_topic(const std::string& name, const std::string& type) = 0;
  virtual void write(std::size_t topic, std::int64_t log_ns, std::string_view bytes) = 0;
  /// Once, at the end.
  virtual void close() = 0;
};

struct McapWriterOptions {
  std::string compression = "zstd";          ///< "", "lz4" or "zstd"
  std::size_t chunk = std::size_t{1} << 20;  ///< bytes before packing; 0: no chunks
  bool indices = true;                       ///< message and chunk indices
  bool summary = true;                       ///< channels once more, and statistics
};

/// Throws lamina::Error when the file cannot be written.
std::unique_ptr<RecordWriter> make_mcap_writer(const std::filesystem::path& file,
                                               const McapWriterOptions& options = {});
/// Tables as Humble writes them.
std::unique_ptr<RecordWriter> make_db3_writer(const std::filesystem::path& file);

}  // namespace lamina::ros2
