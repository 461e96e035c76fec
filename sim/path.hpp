// The true path of a robot: through way-points at constant speed, turning on the spot or in flight.
#pragma once

#include <Eigen/Core>
#include <vector>

#include <lamina/models/lie/se3.hpp>

namespace lamina::sim {

/// Attitude as R = Rz(yaw) Ry(pitch) Rx(roll); angles in rad, unwrapped.
struct Knot {
  double time = 0;  ///< s after the start
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  double yaw = 0, pitch = 0, roll = 0;
};

/// Small smooth rocking added to a path: what a flight or an uneven floor does to a body.
struct Sway {
  double roll = 0, pitch = 0, yaw = 0;  ///< rad, amplitude
  double height = 0;                    ///< m, amplitude
  double period = 4;                    ///< s; the axes use this times 1, 1.3, 1.7 and 2.1
};

class Path {
 public:
  Path() = default;
  explicit Path(std::vector<Knot> knots, const Sway& sway = {});
  /// Drives straight from point to point at `speed` (m/s) and turns towards each next one on the
  /// spot at `turn_rate` (rad/s). Slopes between points pitch the body. `end_yaw`s are not needed:
  /// the first heading is that of the first leg.
  static Path drive(const std::vector<Eigen::Vector3d>& points, double speed, double turn_rate,
                    const Sway& sway = {});
  /// Stays at a pose for `duration` seconds.
  static Path stay(const SE3& T_map_body, double duration);

  double duration() const { return knots_.empty() ? 0 : knots_.back().time; }
  /// T_map_body; before the start and after the end: there.
  SE3 at(double time) const;
  const std::vector<Knot>& knots() const { return knots_; }

 private:
  std::vector<Knot> knots_;
  Sway sway_;
};

}  // namespace lamina::sim
