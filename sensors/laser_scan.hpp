// A 2D scan.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include <lamina/models/timestamp.hpp>
#include <lamina/sensors/calibration.hpp>

namespace lamina {

/// Ranges in the scanner's x-y plane; beam i points along angle_min + i * angle_increment
/// (counter-clockwise for a positive increment; a negative one is legal), or along angles[i].
struct LaserScan {
  Timestamp stamp;
  double angle_min = 0, angle_increment = 0;  ///< rad
  double range_min = 0, range_max = 0;        ///< m
  std::vector<float> ranges;                  ///< m; 0, inf, nan or range_max = no return
  /// s from one beam to the next, beam 0 at `stamp`; 0: unknown, or all beams at once.
  double time_increment = 0;
  /// rad; where the beams of a scan point that has been straightened (sweep.hpp); else empty.
  std::vector<float> angles;
  LidarModel lidar;

  std::size_t size() const { return ranges.size(); }
  double angle(std::size_t i) const {
    return angles.empty() ? angle_min + static_cast<double>(i) * angle_increment
                          : static_cast<double>(angles[i]);
  }
  /// True where beam i has a return inside [range_min, range_max). Many drivers give the largest
  /// range itself where nothing came back: as rounded as the ranges, it is no return either.
  bool valid(std::size_t i) const {
    const float r = ranges[i];
    return std::isfinite(r) && r > 0 && static_cast<double>(r) >= range_min &&
           (range_max <= 0 || r < static_cast<float>(range_max));
  }
  /// The end point of beam i in the scanner frame (m).
  Eigen::Vector2d point(std::size_t i) const {
    const double r = static_cast<double>(ranges[i]), a = angle(i);
    return {r * std::cos(a), r * std::sin(a)};
  }
};

}  // namespace lamina
