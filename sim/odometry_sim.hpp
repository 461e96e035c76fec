// Dead reckoning that drifts: wheels on a floor, or six degrees of freedom.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <lamina/sensors/measurement.hpp>
#include <lamina/sensors/odometry.hpp>
#include <lamina/sim/random.hpp>

namespace lamina::sim {

/// A sudden error that stays: a GPS jump, a slipped wheel, a tumbled gyroscope.
struct OdometryFault {
  double time = 0;  ///< s after the start; takes effect at the first odometry at or after it
  Eigen::Vector3d translation_odom = Eigen::Vector3d::Zero();  ///< m, added to the position
  Eigen::Vector3d rotation_body = Eigen::Vector3d::Zero();     ///< rad, turns the body in place
};

/// How odometry really errs; OdometryModel is what the robot believes of it.
struct OdometryErrors {
  bool noise = true;
  double sigma_translation = 0.02;    ///< m per sqrt(m) travelled
  double sigma_rotation = 0.02;       ///< rad per sqrt(m)
  double sigma_rotation_turn = 0.05;  ///< rad per sqrt(rad) turned
  double scale = 1.0;                 ///< wheel radius error: measured over true distance
  double drift = 0;                   ///< rad of heading per m, systematic
  bool planar = true;                 ///< x, y and heading alone
  std::vector<OdometryFault> faults;
};

/// Integrates noisy increments of the true path. The first pose is the true one, so that the
/// odometry frame is the map frame and drifts from there.
class OdometrySimulator {
 public:
  OdometrySimulator(const OdometryErrors& errors, std::uint64_t seed);
  /// `time`: s after the start, increasing.
  Odometry step(Timestamp stamp, double time, const SE3& T_map_body);

 private:
  SE3 noisy(const SE3& T_from_to);

  OdometryErrors errors_;
  Random random_;
  std::size_t next_fault_ = 0;
  std::optional<SE3> last_map_body_;
  SE3 T_odom_body_;
};

}  // namespace lamina::sim
