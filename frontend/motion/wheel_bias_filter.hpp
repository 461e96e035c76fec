// Lawful errors of wheels, learned on the way from what scans tell of the motion.
#pragma once

#include <optional>

#include <lamina/frontend/motion/paired_motion.hpp>
#include <lamina/frontend/motion/wheel_odometry.hpp>
#include <lamina/models/adoption.hpp>

namespace lamina {

/// Wheels of a wrong radius or track err alike in every step, so that as a prior of scan matching
/// they pull all steps the same way. Over pieces of a metre or half a radian, in each of which
/// scans held all directions, the motion by scans is compared with that by wheels:
///   t_scans . t_wheels / |t_wheels|^2 = 1 + scale,
///   yaw_scans - yaw_wheels = drift |t| + turn_scale yaw_scans
/// (WheelErrors of the backend, without direction and place, to first order). The turn is the
/// scans' and counts from 0.1 rad on: what wheels make up on straight pieces is there on both
/// sides, and would be told as a turn scale of -1. A Kalman filter over these three, zero at first
/// to 5 %, 0.5 deg/m and 5 %, with a slow random walk (loads, floors). Pieces beyond three sigmas
/// (slipping, counters without a sign) tell nothing lawful and are left out.
/// Causal: what was learned before a piece is judged by it, and taken out once it fits pieces that
/// come after better than the wheels as they are (BlockGains, blocks of 4 s).
class WheelLearning {
 public:
  /// `enabled` false: nothing is ever taken out.
  explicit WheelLearning(bool enabled = true);
  /// The scale is known so well before the first piece: it is taken out always, and goes on to be
  /// learned.
  void begin(double scale, double sigma);
  /// The body's motion since the last call, by wheels as measured and by scans, up to `stamp`;
  /// nullopt where one of them does not tell it: the piece begins anew.
  void add(Timestamp stamp, const std::optional<Increment>& by_wheels,
           const std::optional<SE3>& by_scans);
  /// The wheels' motion less what was learned, its covariance with what is not known of it; as it
  /// is while that is not adopted, scale by itself, drift and turns together.
  Increment corrected(const Increment& by_wheels) const;
  /// 1-sigma of what is left in corrected(): scale (1), drift (rad/m), turn scale (1).
  Eigen::Vector3d left() const;
  /// Scale (1), drift (rad/m), turn scale (1), and their covariance.
  const Eigen::Vector3d& errors() const { return errors_; }
  const Eigen::Matrix3d& covariance() const { return covariance_; }
  /// Of the scale, and of drift and turns.
  Adoption scale_adoption() const { return scale_gains_.judge(); }
  Adoption turn_adoption() const { return turn_gains_.judge(); }

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, WheelLearning& v) {
    a(v.errors_, v.covariance_, v.piece_, v.noise_, v.scale_known_, v.scale_gains_, v.turn_gains_,
      v.block_, v.scale_gain_, v.turn_gain_);
  }

 private:
  Eigen::Vector3d used() const;
  void compare(Timestamp stamp);
  /// Returns by how much better the value fits with what was learned before.
  double update(double value, double sigma, const Eigen::Vector3d& gradient);

  Eigen::Vector3d errors_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_;
  PairedMotion piece_;                 // since it began
  Matrix6d noise_ = Matrix6d::Zero();  // the covariance of its wheels
  bool scale_known_ = false;           // from the beginning
  // What was learned, against nothing, by blocks that it had not met then.
  BlockGains scale_gains_, turn_gains_;
  std::int64_t block_ = 0;
  std::optional<double> scale_gain_, turn_gain_;  // of the block that goes on
  bool enabled_;                                  // of the settings: not archived
};

}  // namespace lamina
