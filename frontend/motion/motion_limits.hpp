// How fast a robot may change its speed between two measurements.
#pragma once

#include <cmath>

#include <lamina/frontend/motion/planar.hpp>

namespace lamina {

/// A match that contradicts wheels and breaks off the motion before it, by more than these lengths
/// and accelerations, while wheels go on with that motion, is a match with another place: no robot
/// does that, and wheels that slip do not go on.
struct MotionLimits {
  double least_leap = 0.03;      ///< m: what two measurements' errors make of a steady motion
  double most_acceleration = 5;  ///< m/s^2; braking by wheels ends near 10
  double least_spin = 0.1;       ///< rad, as least_leap
  double most_spin = 10;         ///< rad/s^2, of robots that begin or end a turn
  double steady = 0.33;  ///< wheels go on: off that motion by at most this share of the match
  double stands = 1e-3;  ///< m, rad: with less, wheels stand (or are not counted)

  /// m that a body may leave a steady motion by within `dt` (s).
  double leap(double dt) const { return least_leap + most_acceleration * dt * dt; }
  /// rad, likewise.
  double spin(double dt) const { return least_spin + most_spin * dt * dt; }

  bool wheels_stand(const PlanarPose& by_wheels) const {
    return std::hypot(by_wheels.x, by_wheels.y, by_wheels.yaw) < stands;
  }
  /// All steps: body's pose in its frame `dt` (s) earlier. `going_on`: the motion before, gone on.
  bool leaps(const PlanarPose& found, const PlanarPose& by_wheels, const PlanarPose& going_on,
             double dt) const {
    const double off = (going_on.inverse() * found).translation().norm();
    return off >= leap(dt) && (going_on.inverse() * by_wheels).translation().norm() <= steady * off;
  }
  bool spins(const PlanarPose& found, const PlanarPose& by_wheels, const PlanarPose& going_on,
             double dt) const {
    const double off = std::abs((going_on.inverse() * found).yaw);
    return off >= spin(dt) && std::abs((going_on.inverse() * by_wheels).yaw) <= steady * off;
  }
};

}  // namespace lamina
