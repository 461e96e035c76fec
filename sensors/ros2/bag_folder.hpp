// The files of a ROS 2 recording, in their order.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace lamina::ros2 {

struct BagFiles {
  std::vector<std::filesystem::path> files;  ///< .db3 or .mcap, also .zstd
  std::vector<std::string> problems;         ///< what of metadata.yaml does not fit what is there
  std::optional<std::int64_t> messages;      ///< as metadata.yaml counts them
};

/// Whether a file's name is one of a recording: .db3 or .mcap, also with .zstd or .zst added.
bool is_bag_file(const std::filesystem::path& file);

/// By metadata.yaml, where its names are there: with or without the folder's name before them,
/// which some releases write. Where it is missing, empty, of another recording or unreadable, all
/// files of the folder by their numbers. Throws lamina::Error when there are none.
BagFiles files_of_bag(const std::filesystem::path& folder);

}  // namespace lamina::ros2
