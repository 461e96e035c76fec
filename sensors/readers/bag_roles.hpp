// What a topic's type makes of it.
#pragma once

#include <string>
#include <vector>

#include <lamina/sensors/readers/bag_messages.hpp>

namespace lamina::bag {

/// "scan", "image" (depth, where its first message is), "cloud", "imu", "odom", "tf",
/// "camera_info"; "stream" of what robots record and nothing is mapped with yet (positions of
/// satellites, tags, poses); "" of all else. `type` as ROS 1 has it.
std::string role_of_type(const std::string& type);

/// "/odom (nav_msgs/Odometry, 431), ...": for messages. By name, no more than `most`.
std::string list_of(const std::vector<Topic>& topics, std::size_t most = 30);

/// Whether the topic's first message is a depth image. Selects that topic.
bool holds_depth(Source& source, const std::string& topic);

}  // namespace lamina::bag
