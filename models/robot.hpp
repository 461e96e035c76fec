// The robot that a map is drawn for.
#pragma once

#include <cmath>

namespace lamina {

struct RobotOptions {
  double height = 0.75;          ///< m, what must fit under overhangs: the floor article's robot
  double radius = 0.25;          ///< m, of the circle that holds the robot's outline
  double max_step = 0.02;        ///< m, T: the largest step between cells a wheel climbs
  double max_slope = M_PI / 18;  ///< rad, 10 degrees: wheelchair ramps end near 5
};

}  // namespace lamina
