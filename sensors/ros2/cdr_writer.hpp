// Messages in CDR, for files and for the wire.
#pragma once

#include <string>

#include <lamina/sensors/readers/bag_messages.hpp>

namespace lamina::ros2 {

/// A type's name as ROS 2 has it ("sensor_msgs/msg/LaserScan") and its bytes; the depth of an image
/// goes as 16UC1.
struct CdrMessage {
  std::string type, bytes;
};
/// Of kinds kScan, kDepth, kCameraInfo, kOdometry, kTransform, kImu; others have no type.
CdrMessage encode(const bag::Message& message, bool big_endian = false);

}  // namespace lamina::ros2
