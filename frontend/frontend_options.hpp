// Options of the front-end: of every part of it.
#pragma once

#include <lamina/frontend/depth/floor_options.hpp>
#include <lamina/frontend/motion/scan_odometry.hpp>
#include <lamina/frontend/obstacles/scan_options.hpp>
#include <lamina/frontend/segments/segment_options.hpp>
#include <lamina/models/robot.hpp>

namespace lamina {

struct FrontEndOptions {
  FloorOptions floor;
  ScanOptions scan;  ///< height, step and slope of the robot are taken from `robot`
  RobotOptions robot;
  SegmentOptions segments;
  TrackingOptions tracking;
  ScanOdometryOptions scan_odometry;
  double sweep = 0;  ///< s from a scan's first beam to its last, where the recording does not say
  bool calibrate_wheels = true;  ///< estimate the wheels' systematic errors
};

/// Those of the obstacle scans, with the robot's own height, step and slope.
ScanOptions scan_options(const FrontEndOptions& options);

}  // namespace lamina
