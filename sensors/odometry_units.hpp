// Odometry in other units than metres and radians, as if it were in these.
#pragma once

#include <cmath>
#include <optional>

#include <lamina/sensors/odometry.hpp>

namespace lamina {

/// What a planar odometry's numbers are multiplied by: 0.001 of millimetres, pi / 180 of degrees.
struct OdometryUnits {
  double way = 1, turn = 1;
  bool any() const { return way != 1 || turn != 1; }
};

/// Poses in turn. Headings are followed across their ends of range (less than half a turn, as
/// written, from sample to sample) before they are multiplied.
class OdometryInMetres {
 public:
  explicit OdometryInMetres(const OdometryUnits& units) : units_(units) {}
  Odometry of(Odometry odometry) {
    const SE3 T = odometry.T_odom_body;
    SO3 R = T.so3();
    if (units_.turn != 1) {
      yaw_ += last_yaw_ ? std::remainder(R.yaw() - *last_yaw_, 2 * M_PI) : R.yaw();
      last_yaw_ = R.yaw();
      R = SO3::rot_z(units_.turn * yaw_);
    }
    odometry.T_odom_body = SE3(R, units_.way * T.translation());
    return odometry;
  }

 private:
  OdometryUnits units_;
  double yaw_ = 0;  // as written, without jumps
  std::optional<double> last_yaw_;
};

}  // namespace lamina
