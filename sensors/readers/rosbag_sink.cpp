// Writes ROS 1 messages; compiled as C++17 for the message headers.
#include "bag_sink.hpp"

#include <console_bridge/console.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/LaserScan.h>
#include <tf2_msgs/TFMessage.h>

#include <cstring>
#include <stdexcept>

namespace lamina::bag {
namespace {

ros::Time to_time(std::int64_t ns) {
  return ros::Time(static_cast<std::uint32_t>(ns / kSecond),
                   static_cast<std::uint32_t>(ns % kSecond));
}

std_msgs::Header header_of(const Message& m) {
  std_msgs::Header header;
  header.stamp = to_time(m.stamp_ns);
  header.frame_id = m.frame;
  return header;
}

template <typename Translation, typename Rotation>
void set_pose(const PlainPose& pose, Translation& t, Rotation& q) {
  t.x = pose[0];
  t.y = pose[1];
  t.z = pose[2];
  q.x = pose[3];
  q.y = pose[4];
  q.z = pose[5];
  q.w = pose[6];
}

sensor_msgs::LaserScan scan_of(const Message& m) {
  sensor_msgs::LaserScan out;
  out.header = header_of(m);
  out.angle_min = m.angle_min;
  out.angle_increment = m.angle_increment;
  out.angle_max = m.angle_min + m.angle_increment * static_cast<float>(m.ranges.size() - 1);
  out.time_increment = m.time_increment;
  out.range_min = m.range_min;
  out.range_max = m.range_max;
  out.ranges = m.ranges;
  return out;
}

sensor_msgs::Image image_of(const Message& m) {
  sensor_msgs::Image out;
  out.header = header_of(m);
  out.encoding = "16UC1";
  out.width = static_cast<std::uint32_t>(m.width);
  out.height = static_cast<std::uint32_t>(m.height);
  out.step = 2 * out.width;
  out.data.resize(2 * m.depth.size());
  std::memcpy(out.data.data(), m.depth.data(), out.data.size());
  return out;
}

sensor_msgs::CameraInfo info_of(const Message& m) {
  sensor_msgs::CameraInfo out;
  out.header = header_of(m);
  out.width = static_cast<std::uint32_t>(m.width);
  out.height = static_cast<std::uint32_t>(m.height);
  out.distortion_model = m.distortion_model;
  out.D = m.distortion;
  const auto& k = m.intrinsics;
  out.K = {k[0], 0, k[2], 0, k[1], k[3], 0, 0, 1};
  return out;
}

nav_msgs::Odometry odometry_of(const Message& m) {
  nav_msgs::Odometry out;
  out.header = header_of(m);
  out.child_frame_id = m.child_frame;
  set_pose(m.pose, out.pose.pose.position, out.pose.pose.orientation);
  return out;
}

tf2_msgs::TFMessage transforms_of(const Message& m) {
  tf2_msgs::TFMessage out;
  out.transforms.resize(1);
  out.transforms[0].header = header_of(m);
  out.transforms[0].child_frame_id = m.child_frame;
  set_pose(m.pose, out.transforms[0].transform.translation, out.transforms[0].transform.rotation);
  return out;
}

sensor_msgs::Imu imu_of(const Message& m) {
  sensor_msgs::Imu out;
  out.header = header_of(m);
  out.orientation.w = 1;
  out.linear_acceleration.x = m.acceleration[0];
  out.linear_acceleration.y = m.acceleration[1];
  out.linear_acceleration.z = m.acceleration[2];
  return out;
}

class Ros1Sink final : public Sink {
 public:
  explicit Ros1Sink(const std::string& file) {
    console_bridge::noOutputHandler();  // what fails is thrown, and said once
    ros::Time::init();
    bag_.open(file, rosbag::bagmode::Write);
  }
  void write(const Message& m, std::int64_t log_ns) override {
    const ros::Time time = to_time(log_ns != 0 ? log_ns : m.stamp_ns);
    if (m.kind == Kind::kScan) bag_.write(m.topic, time, scan_of(m));
    if (m.kind == Kind::kDepth) bag_.write(m.topic, time, image_of(m));
    if (m.kind == Kind::kCameraInfo) bag_.write(m.topic, time, info_of(m));
    if (m.kind == Kind::kOdometry) bag_.write(m.topic, time, odometry_of(m));
    if (m.kind == Kind::kTransform) bag_.write(m.topic, time, transforms_of(m));
    if (m.kind == Kind::kImu) bag_.write(m.topic, time, imu_of(m));
  }
  void close() override { bag_.close(); }

 private:
  rosbag::Bag bag_;
};

}  // namespace

std::unique_ptr<Sink> make_ros1_sink(const std::string& file) {
  try {
    return std::make_unique<Ros1Sink>(file);
  } catch (const std::exception& error) {
    throw std::runtime_error(error.what());
  }
}

}  // namespace lamina::bag
