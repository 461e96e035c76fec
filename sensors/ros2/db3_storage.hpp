// ROS 2's SQLite files as storage of messages.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <lamina/sensors/ros2/storage.hpp>

namespace lamina::ros2 {

/// Of every release from Eloquent to Jazzy: tables topics and messages, with whatever further
/// columns and tables. `name` stands in messages. Throws lamina::Error when it is no such database.
std::unique_ptr<Storage> open_db3(const std::filesystem::path& file, const std::string& name);

}  // namespace lamina::ros2
