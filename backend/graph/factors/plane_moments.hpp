// A plane seen from a keyframe: all points of the observation through their moments.
//
// Points x of the observation (body frame, weights 1/sigma^2) have weight w, mean c and scatter
// S = sum_k l_k l_k^T. Their squared distances to the plane n.(x - anchor) = rho of the map sum to
//   w d^2 + sum_k (l_k . n_body)^2,   d = n.(R c + t - anchor) - rho,   n_body = R^T n
// which is p^T M p of the homogeneous moments without its loss of digits far from the origin. The
// residual is (sqrt(w) d, l_1.n_body, l_2.n_body, l_3.n_body): 4 numbers however many points; a
// scan segment has one l, a depth plane two, so full and partial views share the formula.
//
// With T exp(d):  dd/dT = (n_body, c x n_body),  d(l.n_body)/dT = (0, l x n_body),
//                 dd/dplane = ((R c + t - anchor)^T B, -1),  d(l.n_body)/dplane = (l^T R^T B, 0).
#pragma once

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/graph/states.hpp>

namespace lamina {

struct PlaneMomentsTerm {
  static constexpr int kResiduals = 4;
  using Residual = Eigen::Vector4d;
  using Jacobians = TermJacobians<4, PoseState, PlaneState>;
  double root_weight = 0;     ///< sqrt(w), 1/m
  Eigen::Vector3d mean_body;  ///< c
  Eigen::Matrix3d rows;       ///< l_k^T, largest first; unused ones zero
  Eigen::Vector3d anchor_map;

  PlaneMomentsTerm() = default;
  PlaneMomentsTerm(const Moments& moments_body, const Eigen::Vector3d& anchor);

  void evaluate(const PoseState& pose, const PlaneState& plane, Residual& residual,
                Jacobians* J) const {
    const Eigen::Vector3d n_body = pose.R.transpose() * plane.n;
    const Eigen::Vector3d arm = pose.R * mean_body + (pose.t - anchor_map);
    residual(0) = root_weight * (plane.n.dot(arm) - plane.rho);
    residual.tail<3>().noalias() = rows * n_body;
    if (J == nullptr) return;
    auto& J_pose = std::get<0>(*J);
    auto& J_plane = std::get<1>(*J);
    J_pose.row(0).head<3>() = root_weight * n_body;
    J_pose.row(0).tail<3>() = root_weight * mean_body.cross(n_body);
    J_plane.row(0).head<2>().noalias() = root_weight * (arm.transpose() * plane.B);
    J_plane(0, 2) = -root_weight;
    const Matrix32d B_body = pose.R.transpose() * plane.B;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d l = rows.row(k);
      J_pose.row(k + 1).head<3>().setZero();
      J_pose.row(k + 1).tail<3>() = l.cross(n_body);
      J_plane.row(k + 1).head<2>().noalias() = l.transpose() * B_body;
      J_plane(k + 1, 2) = 0;
    }
  }
};

}  // namespace lamina
