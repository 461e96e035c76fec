// Up, as an accelerometer at rest sees it.
//
//   r = log_up(R^T z) / sigma, the geodesic on the sphere from the measured up (body frame) to the
// map's z axis seen from the body, in the measured direction's tangent basis: 2 residuals.
// With T exp(d): d(R^T z)/drotation = hat(R^T z).
#pragma once

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/graph/states.hpp>

namespace lamina {

struct GravityTerm {
  static constexpr int kResiduals = 2;
  using Jacobians = TermJacobians<2, PoseState>;
  Eigen::Vector3d up_body = Eigen::Vector3d::UnitZ();
  Matrix32d basis;
  double inverse_sigma = 1;

  GravityTerm() = default;
  explicit GravityTerm(const GravityFactor& f)
      : up_body(f.up_body.normalized()),
        basis(Plane::tangent_basis(up_body)),
        inverse_sigma(1.0 / f.sigma) {}

  void evaluate(const PoseState& pose, Eigen::Vector2d& residual, Jacobians* J) const;
};

}  // namespace lamina
