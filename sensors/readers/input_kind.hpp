// What a file or folder is that no reader takes, and what to do about it.
#pragma once

#include <filesystem>
#include <string>

namespace lamina {

/// What INPUT may be.
inline constexpr const char* kInputKinds =
    "a dataset folder, .oni, .log, .clf, .rawlog, .bag, .db3, .mcap, a ROS 2 folder, .pcd, "
    "openni:URI, or ros2:[DOMAIN]";

/// The ending in lower case without what says that it is compressed: ".log" of "A.LOG.gz".
std::string ending_of(const std::filesystem::path& path);

/// A file that begins as MCAP does, or a folder with metadata.yaml, .db3 or .mcap files.
bool is_ros2(const std::filesystem::path& path);

/// What was found and what to do, for lamina::Error; both empty where nothing is known of it.
struct InputKind {
  std::string found, advice;
};
/// By the first bytes of a file and its name.
InputKind kind_of_input(const std::filesystem::path& path);

/// Begins like the text of a CARMEN log, compressed or not, whatever its name says.
bool seems_carmen(const std::filesystem::path& file);

/// Why a bag cannot be opened, with the library's reason, and what to do.
InputKind kind_of_bag(const std::filesystem::path& file, const std::string& why);

}  // namespace lamina
