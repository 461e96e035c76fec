// Names of frames, topics and poses in bags.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <string>

#include <lamina/models/lie/se3.hpp>
#include <lamina/sensors/readers/bag_messages.hpp>

namespace lamina::bag {

inline std::string folder_of(const std::string& topic) { return topic.substr(0, topic.rfind('/')); }

inline std::optional<SE3> to_se3(const PlainPose& p) {
  const Eigen::Quaterniond q(p[6], p[3], p[4], p[5]);
  const Eigen::Vector3d t(p[0], p[1], p[2]);
  if (!(std::abs(q.norm() - 1) < 0.1) || !t.allFinite()) return std::nullopt;
  return SE3(SO3(q), t);
}

/// Beams along which nothing can be measured.
inline bool is_empty(const Message& scan) {
  return scan.ranges.size() < 2 || !std::isfinite(scan.angle_min) ||
         !std::isfinite(scan.angle_increment) || scan.angle_increment == 0;
}

inline constexpr double kRawPerMetre = 1000;  // [REP118]: 16UC1 is millimetres

}  // namespace lamina::bag
