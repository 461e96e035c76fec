// Height, roll and pitch of a body's motion, where all that scans and wheels tell lies in a plane.
#pragma once

#include <span>

#include <lamina/frontend/motion/wheel_odometry.hpp>

namespace lamina {

/// The motion of a body that may tilt as the ground does.
Increment tilting(Increment level);

/// The motion with height, roll and pitch as open as ground leaves them over `way` (m) of it.
Increment open_to_slopes(Increment level, double way);

/// What an image adds to a level motion.
struct Lift {
  Vector6d off = Vector6d::Zero();  ///< right tangent: (0, 0, dz, droll, dpitch, 0)
  Eigen::Vector3d variances = Eigen::Vector3d::Zero();  ///< of the three, m^2 and rad^2

  /// `told` by an image of the same way as `level`.
  static Lift between(const Increment& level, const Increment& observed);
  /// The motion with this share of the lift; its other uncertainties stay.
  Increment applied(Increment level, double share = 1) const;
};

/// How much of a lift a motion takes of those it is shared out to: by way (m).
double way_of(const Increment& motion);

/// Lifts level motions that follow each other, so that all of them have the height and tilt told:
/// what tilts early lifts what comes after.
void share_out(const Increment& observed, std::span<Increment> motions);

}  // namespace lamina
