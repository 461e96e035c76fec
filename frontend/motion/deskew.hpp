// Scans of a scanner that moved while its beam went round.
#pragma once

#include <lamina/models/lie/se3.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// The scan as it would have been with all beams measured at its stamp, by a body that moves at
/// `velocity` (its right tangent, m/s and rad/s, in the body): beam i is `beam_time` * i later, so
///   p_0 = T_lidar_body exp(velocity * beam_time * i) T_body_lidar p_i,
/// kept as angle and range in the scanner's plane; what leaves that plane is dropped, so scanners
/// that lie about level gain, others are left to the caller. A scan that moved by less than its own
/// noise at the farthest return, or whose `beam_time` is 0, comes back as it is. The motion must be
/// slow against the beam: where two beams' order changes, they stay in the order they were
/// measured.
LaserScan straightened(LaserScan scan, double beam_time, const Vector6d& velocity);

}  // namespace lamina
