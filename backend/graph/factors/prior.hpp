// A keyframe's pose known from elsewhere, and extrinsics near their calibration.
//
//   pose:       r = S log(Z^-1 T),  dr/dT = S Jr^-1(log(Z^-1 T)),  6 residuals
//   extrinsics: r = x / sigma, about zero,  3 residuals
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

  void evaluate(const PoseState& pose, Vector6d& residual, Jacobians* J) const;
};

struct ExtrinsicsPriorTerm {
  static constexpr int kResiduals = 3;
  using Jacobians = TermJacobians<3, FlatState>;
  Eigen::Vector3d inverse_sigma = Eigen::Vector3d::Zero();

  ExtrinsicsPriorTerm() = default;
  explicit ExtrinsicsPriorTerm(const Extrinsics& sensor)
      : inverse_sigma(sensor.prior_sigma.cwiseInverse()) {}

  void evaluate(const FlatState& sensor, Eigen::Vector3d& residual, Jacobians* J) const {
    residual = inverse_sigma.cwiseProduct(sensor.x);
    if (J != nullptr) std::get<0>(*J) = inverse_sigma.asDiagonal();
  }
};

}  // namespace lamina
