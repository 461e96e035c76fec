// A surfel: a disc of surface with its uncertainty.
#pragma once

#include <Eigen/Core>

#include <lamina/models/lie/se3.hpp>

namespace lamina {

/// A disc. The frame of centre and normal is the owner's to say (`Surfel` in a frame's observation
/// is in the body frame, in a PlanarMap in the map frame).
struct Surfel {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();   ///< m
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, towards the side it was seen from
  double radius = 0;                                  ///< m
  /// Covariance of height along the normal at the centre (m) and the tilts about the two in-plane
  /// axes of Plane::tangent_basis(normal) (rad): order (tilt, tilt, height), as Plane's tangent.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  int parent_plane = -1;     ///< id of the plane it belongs to, -1: none
  int anchor_keyframe = -1;  ///< id of the keyframe whose pose carries it, -1: none

  double sigma_height() const;
  Surfel transformed(const SE3& T_a_b) const;
};

}  // namespace lamina
