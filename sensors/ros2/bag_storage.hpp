// A ROS 2 recording of one file or of several that follow each other, as one storage.
#pragma once

#include <filesystem>
#include <memory>

#include <lamina/sensors/ros2/storage.hpp>

namespace lamina::ros2 {

/// A .db3, .mcap, either of them packed by Zstandard (unpacked to the temporary folder, where the
/// system takes it away again), or a folder of them. Throws lamina::Error naming what cannot be
/// read; of several files one that can is enough.
std::unique_ptr<Storage> open_storage(const std::filesystem::path& path);

}  // namespace lamina::ros2
