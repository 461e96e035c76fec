// Relative motion between two keyframes (odometry, loops) and its planar form.
//
//   r = S log(Z^-1 T_a^-1 T_b),  Z = measured T_from_to,  6 residuals
//   planar: rows x, y and yaw of the same logarithm, 3 residuals
//
// With E = Z^-1 T_a^-1 T_b and right perturbations:
//   dr/db = S Jr^-1(log E),  dr/da = -S Jr^-1(log E) Adj(T_b^-1 T_a).       [Sola2018]
#pragma once

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/graph/states.hpp>

namespace lamina {

struct OdometryTerm {
  static constexpr int kResiduals = 6;
  using Jacobians = TermJacobians<6, PoseState, PoseState>;
  SE3 T_to_from_measured;
  Matrix6d sqrt_information;

  OdometryTerm() = default;
  explicit OdometryTerm(const OdometryFactor& f)
      : T_to_from_measured(f.T_from_to.inverse()), sqrt_information(f.sqrt_information) {}
  explicit OdometryTerm(const LoopFactor& f)
      : T_to_from_measured(f.T_from_to.inverse()), sqrt_information(f.sqrt_information) {}

  void evaluate(const PoseState& a, const PoseState& b, Vector6d& residual, Jacobians* J) const;
};

struct PlanarOdometryTerm {
  static constexpr int kResiduals = 3;
  using Jacobians = TermJacobians<3, PoseState, PoseState>;
  SE3 T_to_from_measured;
  Eigen::Matrix3d sqrt_information;

  PlanarOdometryTerm() = default;
  explicit PlanarOdometryTerm(const PlanarOdometryFactor& f)
      : T_to_from_measured(f.T_from_to.inverse()), sqrt_information(f.sqrt_information) {}

  void evaluate(const PoseState& a, const PoseState& b, Eigen::Vector3d& residual,
                Jacobians* J) const;
};

}  // namespace lamina
