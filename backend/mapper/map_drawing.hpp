// The planar map and the paths, by present estimates.
#pragma once

#include <lamina/backend/mapper/working_map.hpp>
#include <lamina/backend/parameters/wheel_errors.hpp>
#include <lamina/models/planar_map.hpp>

namespace lamina {

/// How sure parameters are that all planes share. Planes that are drawn have it in their
/// covariances; nothing is estimated by it.
struct ParameterUncertainty {
  /// Of where sensors sit on the body: (x, y, heading; m, rad), as by_mounting() takes it.
  Eigen::Matrix3d extrinsics = Eigen::Matrix3d::Zero();
  /// Of wheels by scale, drift (rad/m) and turn scale, as moved_by_wheels() takes it, and what that
  /// makes of keyframes and planes.
  Eigen::Matrix3d wheels = Eigen::Matrix3d::Zero();
  MovedByWheels by_wheels = {};

  /// By the graph as it was last refined.
  void set_wheels(const Graph& graph, const Eigen::Matrix3d& covariance);
};

/// Planes with outlines, labels and covariances, surfels, loose points and the path, map frame.
/// Spurious planes are left out, and what one plane says of several walls is parted.
PlanarMap draw_map(const WorkingMap& map, const ParameterUncertainty& parameters);

/// T_map_body of every frame, by present estimates, or `as_left`: as each left the window.
Trajectory draw_path(const WorkingMap& map, bool as_left = false);

/// m, 1-sigma, as Mapper::path_sigma().
std::optional<double> path_sigma(const Graph& graph, const ParameterUncertainty& parameters);

}  // namespace lamina
