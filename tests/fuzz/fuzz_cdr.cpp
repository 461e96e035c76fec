// Messages of ROS 2 in CDR: the first byte chooses the type, the rest is the message. What is read
// is of the size that it says.
#include <lamina/sensors/ros2/cdr_messages.hpp>

#include <array>

#include "fuzz/fuzz_input.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using lamina::bag::Kind;
  constexpr std::array<const char*, 10> kTypes = {
      "sensor_msgs/LaserScan",  "sensor_msgs/MultiEchoLaserScan",
      "sensor_msgs/Image",      "sensor_msgs/CompressedImage",
      "sensor_msgs/CameraInfo", "sensor_msgs/PointCloud2",
      "sensor_msgs/Imu",        "nav_msgs/Odometry",
      "tf2_msgs/TFMessage",     "sensor_msgs/NavSatFix"};
  if (size == 0) return 0;
  lamina::bag::DepthReader depth;
  lamina::bag::Message message;
  std::deque<lamina::bag::Message> transforms;
  const auto status =
      lamina::ros2::decode(kTypes[data[0] % kTypes.size()],
                           lamina::fuzz::text_of(data + 1, size - 1), depth, message, transforms);
  if (status != lamina::bag::Source::Status::kMessage) return 0;
  const auto pixels =
      static_cast<std::size_t>(message.width) * static_cast<std::size_t>(message.height);
  if (message.kind == Kind::kDepth) lamina::fuzz::demand(message.depth.size() == pixels);
  if (message.kind == Kind::kCloud) lamina::fuzz::demand(message.points.size() == pixels);
  return 0;
}
