// Writes the simulated recording as a ROS 1 bag; compiled as C++17 for the message headers.
#include "sensors/bag_writer.hpp"

#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>
#include <tf2_msgs/TFMessage.h>

#include <cstring>

#include "sensors/openni_driver/simulated_depth.hpp"

namespace lamina::test {
namespace {
sensor_msgs::Image depth_image(const DepthMode& mode, int frame, bool floats) {
  sensor_msgs::Image image;
  image.encoding = floats ? "32FC1" : "16UC1";
  image.width = static_cast<unsigned>(mode.width);
  image.height = static_cast<unsigned>(mode.height);
  const unsigned bytes = floats ? 4 : 2;
  image.step = image.width * bytes;
  image.data.resize(image.step * image.height);
  for (int v = 0; v < mode.height; ++v) {
    for (int u = 0; u < mode.width; ++u) {
      const std::uint16_t mm = simulated_depth_mm(mode, u, v, frame);
      const float metres = static_cast<float>(mm) / 1000.0f;
      unsigned char* pixel = image.data.data() + static_cast<unsigned>(v * mode.width + u) * bytes;
      if (floats) std::memcpy(pixel, &metres, 4);
      if (!floats) std::memcpy(pixel, &mm, 2);
    }
  }
  return image;
}
}  // namespace

void write_simulated_bag(const std::string& file, bool floats, bool transforms_only) {
  ros::Time::init();
  const DepthMode mode;
  rosbag::Bag bag(file, rosbag::bagmode::Write);
  tf2_msgs::TFMessage transforms;
  transforms.transforms.resize(1);
  auto& mount = transforms.transforms[0];
  const std::string body = transforms_only ? "chassis" : "base_link";
  mount.header.frame_id = body;
  mount.child_frame_id = "laser";
  mount.transform.translation.x = 0.2;
  mount.transform.translation.z = 0.3;
  mount.transform.rotation.w = 1;
  bag.write("/tf_static", ros::Time(1, 0), transforms);
  for (int i = 0; i < mode.frames; ++i) {
    const auto ns = static_cast<unsigned>(mode.stamp_us(i) * 1000u);
    const ros::Time stamp(1, ns);
    sensor_msgs::CameraInfo info;
    info.header.stamp = stamp;
    info.width = static_cast<unsigned>(mode.width);
    info.height = static_cast<unsigned>(mode.height);
    info.K = {
        mode.focal(), 0, 0.5 * (mode.width - 1), 0, mode.focal(), 0.5 * (mode.height - 1), 0, 0, 1};
    bag.write("/camera/depth/camera_info", stamp, info);
    sensor_msgs::Image image = depth_image(mode, i, floats);
    image.header.stamp = stamp;
    image.header.frame_id = "camera_optical";
    bag.write("/camera/depth/image_raw", stamp, image);
    nav_msgs::Odometry odometry;
    odometry.header.stamp = stamp;
    odometry.header.frame_id = "odom";
    odometry.child_frame_id = body;
    odometry.pose.pose.position.x = 0.1 * i;
    odometry.pose.pose.orientation.w = 1;
    if (transforms_only) {
      tf2_msgs::TFMessage moved;
      moved.transforms.resize(1);
      moved.transforms[0].header = odometry.header;
      moved.transforms[0].child_frame_id = body;
      moved.transforms[0].transform.translation.x = odometry.pose.pose.position.x;
      moved.transforms[0].transform.rotation.w = 1;
      bag.write("/tf", stamp, moved);
    } else {
      bag.write("/odom", stamp, odometry);
    }
    sensor_msgs::LaserScan scan;
    scan.header.stamp = stamp;
    scan.header.frame_id = "laser";
    scan.angle_min = -1;
    scan.angle_increment = 0.5f;
    scan.range_max = 10;
    // One driver in two states nonsense.
    scan.time_increment = i % 2 == 0 ? 0.005f : 3e9f;
    scan.ranges = {1, 2, 3, static_cast<float>(i), 5};
    bag.write("/scan", stamp, scan);
  }
  bag.close();
}

}  // namespace lamina::test
