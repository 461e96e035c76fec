// What a 2D scan says of a place near its plane.
#pragma once

#include <lamina/models/depth_look.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// Of the beams that pass within `radius` (m) of a point of the scanner frame, in the scan's plane:
/// met where one of them ends within 5 cm and 4 sigma of its distance, past where all end further
/// away. Unknown further than 2 cm off the plane: chairs stand over it.
Sight sight_of(const LaserScan& scan, const Eigen::Vector3d& p_lidar, double radius);

}  // namespace lamina
