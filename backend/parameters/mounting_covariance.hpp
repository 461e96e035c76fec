// What is unknown of where sensors sit, as planes of the map feel it.
#pragma once

#include <Eigen/Core>

#include <lamina/models/plane.hpp>

namespace lamina {

/// Covariance of plane_map about centroid_map in Plane's tangent (tilt, tilt, rho) by an error e =
/// (x, y, heading; m, rad) in how all sensors sit on the body, of covariance `doubt`. Seen by
/// themselves the planes are right, but the body whose first pose T_map_first defines the map
/// stands otherwise among them: they move as one, by T_map_first E(e) T_map_first^-1. Roll, pitch
/// and height the floor tells.
Eigen::Matrix3d by_mounting(const Eigen::Matrix3d& covariance, const SE3& T_map_first,
                            const Plane& plane_map, const Eigen::Vector3d& centroid_map);

}  // namespace lamina
