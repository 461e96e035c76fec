// Options of the grids of a map.
#pragma once

#include <lamina/models/robot.hpp>

namespace lamina {

/// lidar.no_return_is_free.
enum class NoReturn { kAuto, kTrue, kFalse };

struct GridOptions {
  double resolution = 0.05;  ///< m
  RobotOptions robot;
  int threads = 2;
  /// Whether a scanner's beams that did not come back met nothing up to its range_max.
  NoReturn no_return_is_free = NoReturn::kAuto;
};

}  // namespace lamina
