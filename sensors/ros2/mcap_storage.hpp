// MCAP files as storage of messages.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <lamina/sensors/ros2/storage.hpp>

namespace lamina::ros2 {

struct McapOptions {
  std::size_t most_unpacked = std::size_t{1} << 30;  ///< bytes of one chunk
  /// Bytes of chunks held at once, where their times overlap; beyond, order is by chunks.
  std::size_t most_held = std::size_t{512} << 20;
};

/// Chunks without compression, of lz4 and zstd; with or without summary and indices. Only chunks
/// whose times overlap are held in memory. `name` stands in messages. Throws lamina::Error when the
/// file does not begin as MCAP.
std::unique_ptr<Storage> open_mcap(const std::filesystem::path& file, const std::string& name,
                                   const McapOptions& options = {});

}  // namespace lamina::ros2
