// ROS 2's messages to plain structs.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>

#include <lamina/sensors/readers/bag_depth.hpp>
#include <lamina/sensors/readers/bag_messages.hpp>

namespace lamina::ros2 {

/// "sensor_msgs/LaserScan" of "sensor_msgs/msg/LaserScan"; other names stay.
std::string type_of_ros1(const std::string& type);

/// Fills `out`, which has its topic and the time of its recording: that stays where the header's
/// stamp is zero or there is no header. The transforms of a tf message go to the end of
/// `transforms` instead, and `out` stays of kind kOther. `type` as ROS 1 has it.
bag::Source::Status decode(const std::string& type, std::string_view cdr, bag::DepthReader& depth,
                           bag::Message& out, std::deque<bag::Message>& transforms);

}  // namespace lamina::ros2
