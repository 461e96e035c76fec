// A robot that turns in a box room, with a part of itself in its camera's view, or none.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <lamina/pipeline/calibration/camera/robot_pixels.hpp>

namespace lamina {
namespace {

constexpr int kWidth = 80, kHeight = 60;

SE3 mounting() {
  const double pitch = 20 * M_PI / 180;
  return SE3(SO3::rot_y(pitch) * forward_looking_camera().so3(), {0.1, 0, 0.8});
}

// The depth along the optical axis of the floor, the ceiling or the nearest of four walls.
double room_depth(const SE3& T_map_camera, const Eigen::Vector3d& ray) {
  const Eigen::Vector3d from = T_map_camera.translation(), along = T_map_camera.so3() * ray;
  double depth = 1e9;
  const Eigen::Vector3d low(-3, -2, 0), high(2, 4, 2.5);
  for (int axis = 0; axis < 3; ++axis) {
    const double to = along(axis) > 0 ? high(axis) : low(axis);
    if (std::abs(along(axis)) > 1e-9) depth = std::min(depth, (to - from(axis)) / along(axis));
  }
  return depth;
}

// `bend`: 1/m by which all disparities are off, in waves down the image.
DepthFrame image(const SE3& T_odom_body, bool arm, double bend) {
  DepthFrame frame;
  CameraModel& c = frame.camera.camera;
  c.width = kWidth;
  c.height = kHeight;
  c.fx = c.fy = 70;
  c.cx = 0.5 * (kWidth - 1);
  c.cy = 0.5 * (kHeight - 1);
  frame.camera.depth_scale = 5000;
  frame.camera.noise = DepthNoise::kinect(c.fx);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const Eigen::Vector3d ray((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1);
      const bool of_arm = arm && v >= 10 && v < 16;
      const double depth =
          of_arm ? 0.7
                 : 1 / (1 / room_depth(T_odom_body * mounting(), ray) + bend * std::sin(0.2 * v));
      frame.raw.push_back(static_cast<std::uint16_t>(std::lround(5000 * depth)));
    }
  }
  return frame;
}

std::vector<bool> marked(double turn, bool arm, double bend = 0) {
  std::vector<DepthFrame> frames;
  std::vector<SE3> poses;
  for (int k = 0; k < 12; ++k) {
    poses.emplace_back(SO3::rot_z(turn * k), Eigen::Vector3d(0.1 * k - 0.6, 0.05 * k, 0));
    frames.push_back(image(poses.back(), arm, bend));
  }
  std::vector<PosedImage> images;
  for (std::size_t k = 0; k < frames.size(); ++k) images.push_back({&frames[k], poses[k]});
  return robot_pixels(images, mounting());
}

TEST(RobotPixels, APartOfTheRobotStaysWhereTheWorldTurns) {
  const std::vector<bool> pixels = marked(0.25, true);
  ASSERT_EQ(pixels.size(), static_cast<std::size_t>(kWidth * kHeight));
  for (int v = 0; v < kHeight; ++v) {
    const auto row = pixels.begin() + v * kWidth;
    const auto count = std::count(row, row + kWidth, true);
    const bool of_arm = v >= 10 && v < 16, beside = v >= 6 && v < 20;
    EXPECT_TRUE(of_arm ? count == kWidth : beside || count < kWidth / 20) << v << " " << count;
  }
}

TEST(RobotPixels, AFloorThatStaysAsFarIsTheWorlds) {
  const std::vector<bool> pixels = marked(0.25, false);
  EXPECT_LT(std::count(pixels.begin(), pixels.end(), true), kWidth * kHeight / 100);
}

TEST(RobotPixels, AFloorThatImagesBendIsTheWorlds) {
  const std::vector<bool> pixels = marked(0.25, false, 0.1);
  EXPECT_LT(std::count(pixels.begin(), pixels.end(), true), kWidth * kHeight / 100);
}

TEST(RobotPixels, OnAStraightWayNothingIsKnown) { EXPECT_TRUE(marked(0.01, true).empty()); }

}  // namespace
}  // namespace lamina
