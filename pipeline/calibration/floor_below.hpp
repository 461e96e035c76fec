// The floor that an image shows below its camera.
#pragma once

#include <cmath>
#include <optional>

#include <lamina/frontend/motion/step.hpp>

namespace lamina {

/// The largest plane of the step's image that lies below the camera and is level to `most_tilt`
/// (rad), in the camera's frame; its rho is minus the camera's height (m). `R_levelled_camera`:
/// into a frame whose z is up.
inline std::optional<Plane> floor_below(const Step& step, const SO3& R_levelled_camera,
                                        double most_tilt) {
  std::optional<Plane> floor;
  double largest = 0;
  for (const PlaneObservation& seen : step.observations.planes) {
    const Eigen::Vector3d normal = R_levelled_camera * seen.plane_sensor.normal();
    if (normal.z() < std::cos(most_tilt) || seen.moments_sensor.weight() <= largest) continue;
    largest = seen.moments_sensor.weight();
    floor = seen.plane_sensor;
  }
  return floor;
}

}  // namespace lamina
