// Floor points of one keyframe against a surfel carried by another (or by the same).
//
// In the cell's frame the surfel is f(x) = z - h - s.(x, y) = 0, with gradient g = (-s, 1). Points
// of keyframe k come there by x_cell = T_cell_a T_a^-1 T_k x. With the moments (w, c, l_k) as in
// plane_moments.hpp and g_k = g in the axes of keyframe k:
//   r = (sqrt(w) f(c), l_1.g_k, l_2.g_k, l_3.g_k)
// Distances are along the cell's z, not along the normal: |g| = 1 to s^2 / 2, and the cell's z is
// the floor's normal where it was first seen.
#pragma once

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/graph/states.hpp>

namespace lamina {

/// Seen from the keyframe that carries the surfel: the poses drop out.
struct SurfelMomentsOwnTerm {
  static constexpr int kResiduals = 4;
  using Jacobians = TermJacobians<4, FlatState>;
  double root_weight = 0;
  Eigen::Vector3d mean_cell;
  Eigen::Matrix3d rows_cell;

  SurfelMomentsOwnTerm() = default;
  SurfelMomentsOwnTerm(const Moments& moments_body, const SE3& T_body_cell);

  void evaluate(const FlatState& surfel, Eigen::Vector4d& residual, Jacobians* J) const;
};

/// Seen from another keyframe. States: the observing pose, the carrying pose, the surfel.
struct SurfelMomentsTerm {
  static constexpr int kResiduals = 4;
  using Jacobians = TermJacobians<4, PoseState, PoseState, FlatState>;
  double root_weight = 0;
  Eigen::Vector3d mean_body;
  Eigen::Matrix3d rows;
  Eigen::Matrix3d R_body_cell;  ///< of the carrying keyframe
  Eigen::Vector3d t_body_cell;

  SurfelMomentsTerm() = default;
  SurfelMomentsTerm(const Moments& moments_body, const SE3& T_body_cell);

  void evaluate(const PoseState& seen_from, const PoseState& carrier, const FlatState& surfel,
                Eigen::Vector4d& residual, Jacobians* J) const;
};

}  // namespace lamina
