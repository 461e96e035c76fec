// A keyframe's pose known from elsewhere, or a sensor's in the body from its calibration.
//
//   r = S log(Z^-1 T),  dr/dT = S Jr^-1(log(Z^-1 T)),  6 residuals
#pragma once

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/graph/states.hpp>

namespace lamina {

struct PriorTerm {
  static constexpr int kResiduals = 6;
  using Jacobians = TermJacobians<6, PoseState>;
  SE3 T_body_map_measured;
  Matrix6d sqrt_information;

  PriorTerm() = default;
  explicit PriorTerm(const PriorFactor& f)
      : T_body_map_measured(f.T_map_body.inverse()), sqrt_information(f.sqrt_information) {}
  explicit PriorTerm(const Extrinsics& e)
      : T_body_map_measured(e.prior.inverse()),
        sqrt_information(e.prior_sigma.cwiseInverse().asDiagonal()) {}

  void evaluate(const PoseState& pose, Vector6d& residual, Jacobians* J) const;
};

}  // namespace lamina
