// One function a type, fields in the order of its definition [ROS2Interfaces].
#include <lamina/sensors/ros2/cdr_writer.hpp>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

namespace lamina::ros2 {
namespace {

using bag::Kind;
using bag::Message;
using eprosima::fastcdr::Cdr;

void put_header(Cdr& out, const Message& m) {
  out << static_cast<std::int32_t>(m.stamp_ns / bag::kSecond)
      << static_cast<std::uint32_t>(m.stamp_ns % bag::kSecond) << m.frame;
}

void put_zeros(Cdr& out, int count) {
  for (int i = 0; i < count; ++i) out << 0.0;
}

void put_pose(Cdr& out, const bag::PlainPose& pose) {
  for (const double value : pose) out << value;
}

const char* put_scan(Cdr& out, const Message& m) {
  const float last = m.angle_min + m.angle_increment * static_cast<float>(m.ranges.size() - 1);
  const float whole = m.time_increment * static_cast<float>(m.ranges.size());
  out << m.angle_min << last << m.angle_increment << m.time_increment << whole << m.range_min
      << m.range_max << m.ranges << std::vector<float>();
  return "sensor_msgs/msg/LaserScan";
}

const char* put_image(Cdr& out, const Message& m) {
  out << static_cast<std::uint32_t>(m.height) << static_cast<std::uint32_t>(m.width)
      << std::string("16UC1") << std::uint8_t{0} << static_cast<std::uint32_t>(2 * m.width);
  std::vector<std::uint8_t> data;
  data.reserve(2 * m.depth.size());
  for (const std::uint16_t depth : m.depth) {
    data.push_back(static_cast<std::uint8_t>(depth & 255u));
    data.push_back(static_cast<std::uint8_t>(depth >> 8));
  }
  out << data;
  return "sensor_msgs/msg/Image";
}

const char* put_camera_info(Cdr& out, const Message& m) {
  const auto& k = m.intrinsics;
  out << static_cast<std::uint32_t>(m.height) << static_cast<std::uint32_t>(m.width)
      << m.distortion_model << m.distortion;
  for (const double v : {k[0], 0.0, k[2], 0.0, k[1], k[3], 0.0, 0.0, 1.0}) out << v;
  for (const double v : {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}) out << v;
  for (const double v : {k[0], 0.0, k[2], 0.0, 0.0, k[1], k[3], 0.0, 0.0, 0.0, 1.0, 0.0}) out << v;
  for (int i = 0; i < 6; ++i) out << std::uint32_t{0};  // binning, region of interest
  out << false;
  return "sensor_msgs/msg/CameraInfo";
}

const char* put_odometry(Cdr& out, const Message& m) {
  out << m.child_frame;
  put_pose(out, m.pose);
  put_zeros(out, 36 + 6 + 36);  // covariance, twist and its covariance
  return "nav_msgs/msg/Odometry";
}

const char* put_imu(Cdr& out, const Message& m) {
  for (const double v : {0.0, 0.0, 0.0, 1.0}) out << v;  // orientation
  put_zeros(out, 9 + 3 + 9);                             // covariance, rates and their covariance
  for (const double v : m.acceleration) out << v;
  put_zeros(out, 9);
  return "sensor_msgs/msg/Imu";
}

}  // namespace

CdrMessage encode(const Message& m, bool big_endian) {
  eprosima::fastcdr::FastBuffer buffer;
  Cdr out(buffer, big_endian ? Cdr::BIG_ENDIANNESS : Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
  out.serialize_encapsulation();
  CdrMessage result;
  if (m.kind == Kind::kTransform) out << std::uint32_t{1};
  put_header(out, m);
  if (m.kind == Kind::kScan) result.type = put_scan(out, m);
  if (m.kind == Kind::kDepth) result.type = put_image(out, m);
  if (m.kind == Kind::kCameraInfo) result.type = put_camera_info(out, m);
  if (m.kind == Kind::kOdometry) result.type = put_odometry(out, m);
  if (m.kind == Kind::kImu) result.type = put_imu(out, m);
  if (m.kind == Kind::kTransform) {
    out << m.child_frame;
    put_pose(out, m.pose);
    result.type = "tf2_msgs/msg/TFMessage";
  }
  result.bytes.assign(buffer.getBuffer(), out.getSerializedDataLength());
  return result;
}

}  // namespace lamina::ros2
