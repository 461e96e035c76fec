// Dead reckoning: a pose in a frame that drifts.
#pragma once

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/timestamp.hpp>
#include <lamina/sensors/calibration.hpp>

namespace lamina {

struct Odometry {
  Timestamp stamp;
  SE3 T_odom_body;
  bool interpolated = false;  ///< between recorded samples, at another sensor's time
  bool restarted = false;     ///< counted from elsewhere: the motion to here is not known
};

/// Covariance of the increment T_from_to in its right tangent (translation, rotation), by the
/// model's random walk over the distance and the angle travelled. Never singular: planar odometry
/// holds height, roll and pitch with small sigmas of their own.
Matrix6d increment_covariance(const OdometryModel& model, const SE3& T_from_to);

}  // namespace lamina
