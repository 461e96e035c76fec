// Turning a camera's mounting so that a plane becomes the floor.
#pragma once

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/plane.hpp>

namespace lamina {

/// The mounting in which `floor_camera` is z = 0: T_body_camera turned by the smallest rotation
/// that brings the floor's normal to z (heading is kept), x and y as they were, height from the
/// floor. A normal that points straight down is turned about x.
SE3 leveled(const SE3& T_body_camera, const Plane& floor_camera);

/// The same as numbers: rotation vector (about body x: roll, about body y: pitch) that leveled()
/// applies in the body frame, and the height of the optical centre.
struct Leveling {
  double roll = 0, pitch = 0;  ///< rad
  double height = 0;           ///< m
};
Leveling leveling_of(const SE3& T_body_camera, const Plane& floor_camera);
SE3 apply(const Leveling& leveling, const SE3& T_body_camera);

}  // namespace lamina
