// A table of types.
#include <lamina/sensors/readers/bag_roles.hpp>

#include <map>

namespace lamina::bag {

std::string role_of_type(const std::string& type) {
  static const std::map<std::string, std::string> roles = {
      {"sensor_msgs/LaserScan", "scan"},
      {"sensor_msgs/MultiEchoLaserScan", "scan"},
      {"sensor_msgs/Image", "image"},
      {"sensor_msgs/CompressedImage", "image"},
      {"sensor_msgs/PointCloud2", "cloud"},
      {"sensor_msgs/Imu", "imu"},
      {"sensor_msgs/CameraInfo", "camera_info"},
      {"nav_msgs/Odometry", "odom"},
      {"tf2_msgs/TFMessage", "tf"},
      {"tf/tfMessage", "tf"},
      {"sensor_msgs/NavSatFix", "stream"},
      {"geometry_msgs/PoseWithCovarianceStamped", "stream"},
      {"apriltag_msgs/AprilTagDetectionArray", "stream"},
      {"apriltag_ros/AprilTagDetectionArray", "stream"},
  };
  const auto found = roles.find(type);
  return found == roles.end() ? std::string() : found->second;
}

std::string list_of(const std::vector<Topic>& topics, std::size_t most) {
  std::string text;
  for (std::size_t i = 0; i < topics.size() && i < most; ++i) {
    const Topic& topic = topics[i];
    text += (i > 0 ? ", " : "") + topic.name + " (" + topic.type + ", " +
            std::to_string(topic.count) + (topic.unread.empty() ? "" : ", " + topic.unread) + ")";
  }
  if (topics.size() > most) text += " and " + std::to_string(topics.size() - most) + " more";
  return text.empty() ? "no topic at all" : text;
}

bool holds_depth(Source& source, const std::string& topic) {
  source.select({topic});
  Message message;
  return source.next(message) == Source::Status::kMessage && message.kind == Kind::kDepth;
}

}  // namespace lamina::bag
