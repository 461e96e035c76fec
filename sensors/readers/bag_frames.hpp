// Names of frames, topics and poses in bags.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include <lamina/models/lie/se3.hpp>
#include <lamina/sensors/readers/rosbag_source.hpp>

namespace lamina::bag {

inline std::string folder_of(const std::string& topic) { return topic.substr(0, topic.rfind('/')); }

inline std::optional<SE3> to_se3(const PlainPose& p) {
  const Eigen::Quaterniond q(p[6], p[3], p[4], p[5]);
  const Eigen::Vector3d t(p[0], p[1], p[2]);
  if (!(std::abs(q.norm() - 1) < 0.1) || !t.allFinite()) return std::nullopt;
  return SE3(SO3(q), t);
}

}  // namespace lamina::bag
