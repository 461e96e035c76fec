// Pixels of a depth camera that show the robot itself, or dirt on its lens: no measurement of the
// world.
#pragma once

#include <vector>

#include <lamina/models/lie/se3.hpp>
#include <lamina/sensors/depth_frame.hpp>

namespace lamina {

/// An image and the wheels' pose then.
struct PosedImage {
  const DepthFrame* frame;
  SE3 T_odom_body;
};

/// What a robot sees of the world changes as it turns, but for what is level (the floor, a
/// ceiling). Pixels, row-major, whose depth stays the same in (nearly) all headings, that are not
/// part of a level surface, and behind which, carried on as points of the world, the world is seen
/// from the next poses; with those next to them. Empty: none, or the robot did not turn enough.
/// `T_body_camera` has the floor level.
std::vector<bool> robot_pixels(const std::vector<PosedImage>& images, const SE3& T_body_camera);

}  // namespace lamina
