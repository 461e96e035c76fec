// Residuals of poses alone: odometry, priors, gravity.
#include <lamina/backend/graph/factors/gravity.hpp>
#include <lamina/backend/graph/factors/odometry.hpp>
#include <lamina/backend/graph/factors/prior.hpp>

namespace lamina {
namespace {

/// log(Z^-1 T_a^-1 T_b), with J_b = Jr^-1 and J_a = -Jr^-1 Adj(T_b^-1 T_a), not whitened.
Vector6d relative_error(const SE3& T_to_from_measured, const PoseState& a, const PoseState& b,
                        Matrix6d* J_a, Matrix6d* J_b) {
  // Differences of translations first: they are small where both are far from the origin.
  const Eigen::Vector3d t_a_b = a.R.transpose() * (b.t - a.t);
  const SE3 T_a_b(SO3(a.q.conjugate() * b.q), t_a_b);
  const Vector6d error = (T_to_from_measured * T_a_b).log();
  if (J_a != nullptr) {
    *J_b = SE3::left_jacobian_inverse(-error);
    J_a->noalias() = -*J_b * T_a_b.inverse().adjoint();
  }
  return error;
}

}  // namespace

void OdometryTerm::evaluate(const PoseState& a, const PoseState& b, Vector6d& residual,
                            Jacobians* J) const {
  Matrix6d J_a, J_b;
  residual.noalias() = sqrt_information * relative_error(T_to_from_measured, a, b,
                                                         J != nullptr ? &J_a : nullptr, &J_b);
  if (J == nullptr) return;
  std::get<0>(*J).noalias() = sqrt_information * J_a;
  std::get<1>(*J).noalias() = sqrt_information * J_b;
}

void PlanarOdometryTerm::evaluate(const PoseState& a, const PoseState& b, Eigen::Vector3d& residual,
                                  Jacobians* J) const {
  Matrix6d J_a, J_b;
  const Vector6d error =
      relative_error(T_to_from_measured, a, b, J != nullptr ? &J_a : nullptr, &J_b);
  residual = sqrt_information * Eigen::Vector3d(error(0), error(1), error(5));
  if (J == nullptr) return;
  const auto rows = [this](const Matrix6d& full) {
    Eigen::Matrix<double, 3, 6> picked;
    picked << full.row(0), full.row(1), full.row(5);
    return (sqrt_information * picked).eval();
  };
  std::get<0>(*J) = rows(J_a);
  std::get<1>(*J) = rows(J_b);
}

void PriorTerm::evaluate(const PoseState& pose, Vector6d& residual, Jacobians* J) const {
  const Vector6d error = (T_body_map_measured * pose.se3()).log();
  residual.noalias() = sqrt_information * error;
  if (J != nullptr) {
    std::get<0>(*J).noalias() = sqrt_information * SE3::left_jacobian_inverse(-error);
  }
}

void GravityTerm::evaluate(const PoseState& pose, Eigen::Vector2d& residual, Jacobians* J) const {
  const Eigen::Vector3d up = pose.R.row(2);
  Eigen::Matrix<double, 2, 3> dv;
  residual = inverse_sigma * sphere_log(up_body, basis, up, J != nullptr ? &dv : nullptr);
  if (J == nullptr) return;
  std::get<0>(*J).leftCols<3>().setZero();
  std::get<0>(*J).rightCols<3>() = inverse_sigma * dv * SO3::hat(up);
}

}  // namespace lamina
