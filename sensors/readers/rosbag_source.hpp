// ROS 1 bags by a plain interface.
#pragma once

#include <memory>
#include <string>

#include <lamina/sensors/readers/bag_messages.hpp>

namespace lamina::bag {

/// Throws std::runtime_error with the library's reason when the file is no readable bag.
std::unique_ptr<Source> open_ros1(const std::string& file);

}  // namespace lamina::bag
