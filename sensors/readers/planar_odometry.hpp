// Whether odometry is that of a body on a floor: as stated, else as its poses show.
#pragma once

#include <string>
#include <vector>

#include <lamina/models/trajectory.hpp>
#include <lamina/models/warning.hpp>
#include <lamina/sensors/calibration.hpp>

namespace lamina {

/// How far a body's odometry leaves a plane: a robot on a floor changes its heading alone.
struct OffPlane {
  double height = 0;  ///< m between the 5th and the 95th hundredth of the heights
  double tilt = 0;    ///< rad, root mean square of the body's z about its mean
  /// More than what a floor's unevenness and an inertial unit's noise make of it.
  bool leaves() const { return height > kHeight || tilt > kTilt; }
  /// So far that no floor explains it.
  bool flies() const { return height > 10 * kHeight || tilt > 5 * kTilt; }
  static constexpr double kHeight = 0.15, kTilt = 0.017;  // m; rad, one degree
};
OffPlane off_plane(const Trajectory& odometry);

/// Settles odometry.planar by `odometry` where no file states it (`stated`); a statement that it
/// clearly contradicts is a warning. Remarks say so.
void settle_planar(const Trajectory& odometry, bool stated, Calibration& calibration,
                   std::vector<std::string>& remarks, std::vector<Warning>& warnings);

}  // namespace lamina
