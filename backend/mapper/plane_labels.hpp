// What a plane is to a robot: floor, ramp, step, wall, ceiling or other, from refined geometry.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include <lamina/models/planar_map.hpp>

namespace lamina {

struct LabelOptions {
  double level_tilt_deg = 2.5;   ///< horizontal within this (and three sigmas): ramps start at 1:20
  double max_ramp_deg = 30;      ///< steeper is no ramp
  double wall_tilt_deg = 15;     ///< vertical within this
  double ceiling_tilt_deg = 15;  ///< facing down within this
  /// Horizontal planes this near to the floor's level are the floor: unevenness and drift.
  double same_level_m = 0.02;
  double max_step_m = 0.35;  ///< horizontal, off the floor by at most this: a step
  /// Horizontal, of at least this area and stood over by the robot: a floor of its own.
  double floor_area_m2 = 2;
  double body_height_m = 0.3;  ///< a floor lies at most this far above or below the path
  /// Where nothing does: the body is a camera carried over the floor, at most so high.
  double carried_height_m = 2.2;

  std::vector<std::string> problems() const;
};

/// Sets the label of every plane. The dominant floor is the level with the largest area of upward
/// planes under the path (any upward ones when the path is empty); tilt is measured against it when
/// it is itself nearly level, against z otherwise.
void label_planes(std::vector<MapPlane>& planes, const Trajectory& path,
                  const LabelOptions& options);

}  // namespace lamina
