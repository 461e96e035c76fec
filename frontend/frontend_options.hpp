// Options of the front-end: of every part of it.
#pragma once

#include <lamina/frontend/depth/floor_options.hpp>
#include <lamina/frontend/motion/motion_options.hpp>
#include <lamina/frontend/obstacles/scan_options.hpp>
#include <lamina/frontend/segments/segment_options.hpp>
#include <lamina/models/robot.hpp>

namespace lamina {

struct FrontEndOptions : MotionOptions {
  FloorOptions floor;
  ScanOptions scan;  ///< height, step and slope of the robot are taken from `robot`
  RobotOptions robot;
  SegmentOptions segments;
  TrackingOptions tracking;
};

/// Those of the obstacle scans, with the robot's own height, step and slope.
ScanOptions scan_options(const FrontEndOptions& options);

}  // namespace lamina
