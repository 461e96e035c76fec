// What the parts of the front-end share.
#include <lamina/frontend/frontend_options.hpp>

#include <algorithm>

namespace lamina {

ScanOptions scan_options(const FrontEndOptions& options) {
  ScanOptions scan = options.scan;
  scan.robot_height_m = options.robot.height;
  scan.max_step_m = options.robot.max_step;
  // A ramp that is too steep for the robot is still no hole: it is judged in the grid.
  scan.max_slope_deg = std::max(scan.max_slope_deg, options.robot.max_slope * 180 / M_PI);
  return scan;
}

}  // namespace lamina
