// A surfel lies on its parent plane.
//
// With the plane's normal in the cell's axes n_c = R_cell^T R^T n and the surfel's middle (0, 0, h)
// of the cell at X in the map:
//   r = ((n.(X - anchor) - rho) / sigma_height, (n_c.xy + s n_c.z) / sigma_slope)
// 3 residuals; no division by n_c.z, so that a wall for a parent is wrong but not infinite. Meant
// with a robust kernel (kSurfelParentScale, Cauchy): a 1 cm slab is not ironed flat.
#pragma once

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/graph/states.hpp>

namespace lamina {

/// Scale of the Cauchy kernel on |r|.
inline constexpr double kSurfelParentScale = 2.0;

struct SurfelParentTerm {
  static constexpr int kResiduals = 3;
  using Jacobians = TermJacobians<3, PoseState, PlaneState, FlatState>;
  Eigen::Matrix3d R_body_cell;
  Eigen::Vector3d t_body_cell;
  Eigen::Vector3d anchor_map;
  double inverse_sigma_height = 1, inverse_sigma_slope = 1;

  SurfelParentTerm() = default;
  SurfelParentTerm(const SurfelParentFactor& f, const SE3& T_body_cell,
                   const Eigen::Vector3d& anchor);

  void evaluate(const PoseState& carrier, const PlaneState& plane, const FlatState& surfel,
                Eigen::Vector3d& residual, Jacobians* J) const;
};

}  // namespace lamina
