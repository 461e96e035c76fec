// Squares of a depth image: thin things count, too many lost pixels are no sight.
#include <gtest/gtest.h>

#include <lamina/frontend/obstacles/coarse_depth.hpp>

namespace lamina {
namespace {

DepthFrame wall(double depth) {
  DepthFrame frame;
  CameraModel& camera = frame.camera.camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 267;
  camera.cx = 159.5;
  camera.cy = 119.5;
  frame.camera.noise = DepthNoise::kinect(267);
  frame.raw.assign(320 * 240, static_cast<std::uint16_t>(depth * frame.camera.depth_scale));
  return frame;
}

Sight ahead(const DepthFrame& frame, double z) {
  return depth_look(frame).at({0.03, 0.03, z}, 0.06);
}

TEST(DepthLooker, SeesAWallAndWhatIsBeforeIt) {
  const DepthLook look = depth_look(wall(3));
  EXPECT_EQ(look.nx, 40);
  EXPECT_EQ(look.ny, 30);
  EXPECT_NEAR(look.pixel, 1 / 267.0, 1e-6);
  EXPECT_EQ(ahead(wall(3), 3), Sight::kMet);
  EXPECT_EQ(ahead(wall(3), 2), Sight::kPast);
}

TEST(DepthLooker, APoleOfOnePixelIsMet) {
  DepthFrame frame = wall(3);
  for (int v = 0; v < 240; ++v) frame.raw[static_cast<std::size_t>(v) * 320 + 164] = 2000;
  EXPECT_EQ(ahead(frame, 2), Sight::kMet);
}

TEST(DepthLooker, WhatSwallowsLightIsNotSeenThrough) {
  DepthFrame frame = wall(3);
  for (int v = 0; v < 240; ++v) frame.raw[static_cast<std::size_t>(v) * 320 + 164] = 0;
  EXPECT_EQ(ahead(frame, 2), Sight::kUnknown);
  frame = wall(3);
  frame.raw[125 * 320 + 164] = 0;  // a single one is noise
  EXPECT_EQ(ahead(frame, 2), Sight::kPast);
}

TEST(DepthLooker, AnImageThatIsNoneGivesNoLook) {
  DepthFrame frame = wall(3);
  frame.raw.resize(100);
  EXPECT_TRUE(depth_look(frame).empty());
  frame = wall(3);
  frame.camera.camera.fx = 0;
  EXPECT_TRUE(depth_look(frame).empty());
  EXPECT_TRUE(depth_look(DepthFrame()).empty());
}

}  // namespace
}  // namespace lamina
