// Residual and Jacobian of a marginal prior.
#include <lamina/backend/graph/factors/marginal_prior.hpp>

namespace lamina {

Vector6d marginal_delta(const SE3& linear, const PoseState& state, Matrix6d* derivative) {
  const SE3 error(linear.so3().inverse() * SO3(state.q),
                  linear.so3().inverse() * (state.t - linear.translation()));
  const Vector6d d = error.log();
  if (derivative != nullptr) *derivative = SE3::left_jacobian_inverse(-d);
  return d;
}

Eigen::Vector3d marginal_delta(const Plane& linear, const PlaneState& state,
                               Eigen::Matrix3d* derivative) {
  Eigen::Vector3d d;
  Eigen::Matrix<double, 2, 3> dv;
  d.head<2>() = sphere_log(linear.normal(), linear.tangent_basis(), state.n,
                           derivative != nullptr ? &dv : nullptr);
  d.z() = state.rho - linear.rho();
  if (derivative != nullptr) {
    derivative->setZero();
    derivative->topLeftCorner<2, 2>() = dv * state.B;
    (*derivative)(2, 2) = 1;
  }
  return d;
}

void evaluate_marginal_prior(const MarginalPrior& prior, std::span<const PoseState> poses,
                             std::span<const PlaneState> planes, std::span<const FlatState> surfels,
                             Eigen::VectorXd& residual, Eigen::MatrixXd* jacobian) {
  const Eigen::MatrixXd& S = prior.sqrt_information;
  Eigen::VectorXd d(prior.dimension());
  if (jacobian != nullptr) jacobian->resize(S.rows(), S.cols());
  Eigen::Index at = 0;
  for (std::size_t i = 0; i < poses.size(); ++i, at += 6) {
    Matrix6d D;
    d.segment<6>(at) =
        marginal_delta(prior.poses_linear[i], poses[i], jacobian != nullptr ? &D : nullptr);
    if (jacobian != nullptr) jacobian->middleCols<6>(at).noalias() = S.middleCols<6>(at) * D;
  }
  for (std::size_t i = 0; i < planes.size(); ++i, at += 3) {
    Eigen::Matrix3d D;
    d.segment<3>(at) =
        marginal_delta(prior.planes_linear[i], planes[i], jacobian != nullptr ? &D : nullptr);
    if (jacobian != nullptr) jacobian->middleCols<3>(at).noalias() = S.middleCols<3>(at) * D;
  }
  for (std::size_t i = 0; i < surfels.size(); ++i, at += 3) {
    d.segment<3>(at) = surfels[i].x - prior.surfels_linear[i];
    if (jacobian != nullptr) jacobian->middleCols<3>(at) = S.middleCols<3>(at);
  }
  residual.noalias() = prior.residual + S * d;
}

}  // namespace lamina
