// A ROS 2 recording's messages as plain structs.
#pragma once

#include <memory>

#include <lamina/sensors/readers/bag_messages.hpp>
#include <lamina/sensors/ros2/storage.hpp>

namespace lamina::ros2 {

struct SourceOptions {
  std::size_t largest_message = std::size_t{1} << 29;  ///< bytes of one that was packed
};

/// Messages of CDR, each packed by Zstandard or not; topics of another serialization are listed as
/// unread.
std::unique_ptr<bag::Source> make_source(std::unique_ptr<Storage> storage,
                                         const SourceOptions& options = {});

}  // namespace lamina::ros2
