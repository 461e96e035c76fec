// What the first messages of a robot say, and what is still missing to place its sensors.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lamina/sensors/readers/bag_messages.hpp>

namespace lamina::ros2 {

class LiveLook {
 public:
  /// A message of a topic of this role (bag_roles.hpp). Of frames the first of each topic counts.
  void add(const std::string& role, const bag::Message& message);
  /// Topics with a scan, depth image or cloud.
  bool has_frames() const { return !frames_.empty(); }
  bool has(const std::string& topic) const { return seen_.count(topic) > 0; }
  /// What a frame's topic lacks, in words: "transforms to 'laser'", "camera information of
  /// /camera/depth". Empty: all is there.
  std::vector<std::string> missing() const;
  /// Frame of the odometry's poses, and of the body; empty where none is known.
  std::string odometry_frame() const { return odometry_frame_; }

 private:
  std::map<std::string, bag::Message> frames_;  // by topic, without their data
  std::map<std::string, bool> seen_;
  std::vector<bag::Message> small_;
  std::string odometry_frame_;
};

}  // namespace lamina::ros2
