// A running ROS 2 robot's messages as those of a recording that goes on.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <lamina/sensors/dds/wire.hpp>
#include <lamina/sensors/readers/bag_live.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sensors/ros2/live_queue.hpp>

namespace lamina::ros2 {

struct LiveOptions {
  double first = 30;    ///< s that the first scan, depth image or cloud is waited for
  double look = 2;      ///< s from it on that are looked at before anything is mapped
  double complete = 5;  ///< s more for transforms, camera information and odometry
  double gone = 5;      ///< s without a publisher of what is mapped, after which the run ends
  double ask = 0.05;    ///< s from one question whether to end to the next
  LiveQueueOptions queue;
  std::function<bool()> ended = [] { return false; };
  std::function<void(const std::string&)> say = [](const std::string&) {};  ///< lines for people
  /// Frames of odometry and body as the robot names them, once they are known.
  std::function<void(const std::string& odometry, const std::string& body)> on_frames =
      [](const std::string&, const std::string&) {};
};

/// Takes the first look: returns once scans, depth images or clouds came for `look` seconds and
/// all is there that places their sensors, or the time for it is over.
std::unique_ptr<bag::LiveSource> make_live_source(std::unique_ptr<dds::Wire> wire,
                                                  const LiveOptions& options);

/// "ros2:" or "ros2:DOMAIN"; without one, ROS_DOMAIN_ID says it.
inline bool is_live(const std::string& input) { return input.rfind("ros2:", 0) == 0; }

/// Throws lamina::Error where it is no domain.
int live_domain(const std::string& input);

/// Opens what is_live(). Throws lamina::Error where there is no DDS, or where nothing comes that
/// can be mapped.
std::unique_ptr<Recording> open_live(const std::string& input, const RecordingOptions& options,
                                     const LiveOptions& live);

}  // namespace lamina::ros2
