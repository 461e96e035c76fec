// What marginalised states left behind.
//
//   r = r0 + S d,  d = (T_lin^-1 T).log for poses, plane.boxminus(plane_lin), x - x_lin, stacked
// S stays what it was when the states were eliminated (first-estimate Jacobians); the derivative of
// d itself is exact: Jr^-1(log(T_lin^-1 T)) for a pose, sphere_log's for a plane.
#pragma once

#include <Eigen/Core>
#include <span>

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/graph/states.hpp>

namespace lamina {

/// d of a pose from its linearisation point, and its derivative to the pose's tangent.
Vector6d marginal_delta(const SE3& linear, const PoseState& state, Matrix6d* derivative);
/// d of a plane from its linearisation point, and its derivative to the plane's tangent.
Eigen::Vector3d marginal_delta(const Plane& linear, const PlaneState& state,
                               Eigen::Matrix3d* derivative);

/// Residual of the prior at these states (in the factor's order), and its Jacobian to their stacked
/// tangents: rows x dimension(). The Jacobian is not touched when null.
void evaluate_marginal_prior(const MarginalPrior& prior, std::span<const PoseState> poses,
                             std::span<const PlaneState> planes, std::span<const FlatState> surfels,
                             Eigen::VectorXd& residual, Eigen::MatrixXd* jacobian);

}  // namespace lamina
