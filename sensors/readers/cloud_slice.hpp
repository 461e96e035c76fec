// A band of heights out of the clouds of a scanner with several rings, as scans of one.
#pragma once

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <lamina/models/lie/se3.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

struct CloudSlice {
  double low = 0, high = 0;  ///< m above the floor (z of the body)
  double step = M_PI / 720;  ///< rad between beams: rings have 0.1 to 0.4 degrees between points
  double nearest = 0.3;      ///< m: what is nearer is the robot
  double furthest = 100;     ///< m, range_max: beyond what scanners of several rings reach
};
/// "LOW,HIGH"; throws lamina::Error naming topics.cloud_slice when it is not.
CloudSlice parse_cloud_slice(const std::string& text);

/// Where a level scanner stands that sees the band: at the cloud sensor's place, in the middle of
/// the band, turned as the sensor's x axis points.
SE3 slice_pose(const SE3& T_body_sensor, const CloudSlice& slice);

/// The nearest point of each beam of that scanner. Beams without a point have no return (0).
LaserScan slice_of(const std::vector<std::array<float, 3>>& points_sensor, const SE3& T_body_sensor,
                   const CloudSlice& slice);

}  // namespace lamina
