// Options of ego-motion.
#pragma once

#include <lamina/frontend/motion/scan_odometry.hpp>

namespace lamina {

struct MotionOptions {
  ScanOdometryOptions scan_odometry;
  double sweep = 0;  ///< s from a scan's first beam to its last, where the recording does not say
  bool calibrate_wheels = true;  ///< estimate the wheels' systematic errors
};

}  // namespace lamina
