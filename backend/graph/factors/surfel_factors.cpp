// Residuals of floor surfels: their evidence and their parent planes.
#include <cmath>

#include <lamina/backend/graph/factors/surfel_moments.hpp>
#include <lamina/backend/graph/factors/surfel_parent.hpp>

namespace lamina {
namespace {

Eigen::Vector3d gradient(const Eigen::Vector3d& surfel) { return {-surfel.y(), -surfel.z(), 1}; }

double height_error(const Eigen::Vector3d& surfel, const Eigen::Vector3d& x_cell) {
  return x_cell.z() - surfel.x() - surfel.tail<2>().dot(x_cell.head<2>());
}

}  // namespace

SurfelMomentsOwnTerm::SurfelMomentsOwnTerm(const Moments& moments_body, const SE3& T_body_cell) {
  const Moments moments_cell = moments_body.transformed(T_body_cell.inverse());
  root_weight = std::sqrt(std::max(0.0, moments_cell.weight()));
  mean_cell = moments_cell.mean();
  rows_cell = scatter_root(moments_cell.scatter());
}

void SurfelMomentsOwnTerm::evaluate(const FlatState& surfel, Eigen::Vector4d& residual,
                                    Jacobians* J) const {
  residual(0) = root_weight * height_error(surfel.x, mean_cell);
  residual.tail<3>() = rows_cell * gradient(surfel.x);
  if (J == nullptr) return;
  auto& J_surfel = std::get<0>(*J);
  J_surfel.row(0) << -root_weight, -root_weight * mean_cell.x(), -root_weight * mean_cell.y();
  J_surfel.bottomLeftCorner<3, 1>().setZero();
  J_surfel.bottomRightCorner<3, 2>() = -rows_cell.leftCols<2>();
}

SurfelMomentsTerm::SurfelMomentsTerm(const Moments& moments_body, const SE3& T_body_cell)
    : root_weight(std::sqrt(std::max(0.0, moments_body.weight()))),
      mean_body(moments_body.mean()),
      rows(scatter_root(moments_body.scatter())),
      R_body_cell(T_body_cell.so3().matrix()),
      t_body_cell(T_body_cell.translation()) {}

void SurfelMomentsTerm::evaluate(const PoseState& seen_from, const PoseState& carrier,
                                 const FlatState& surfel, Eigen::Vector4d& residual,
                                 Jacobians* J) const {
  const Eigen::Matrix3d R_a_k = carrier.R.transpose() * seen_from.R;
  const Eigen::Vector3d mean_a =
      R_a_k * mean_body + carrier.R.transpose() * (seen_from.t - carrier.t);
  const Eigen::Vector3d mean_cell = R_body_cell.transpose() * (mean_a - t_body_cell);
  const Eigen::Vector3d g_a = R_body_cell * gradient(surfel.x);
  const Eigen::Vector3d g_k = R_a_k.transpose() * g_a;
  residual(0) = root_weight * height_error(surfel.x, mean_cell);
  residual.tail<3>() = rows * g_k;
  if (J == nullptr) return;
  auto& [J_seen, J_carrier, J_surfel] = *J;
  const double w = root_weight;
  J_seen.row(0) << w * g_k.transpose(), w * mean_body.cross(g_k).transpose();
  J_carrier.row(0) << -w * g_a.transpose(), -w * mean_a.cross(g_a).transpose();
  J_surfel.row(0) << -w, -w * mean_cell.x(), -w * mean_cell.y();
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d l = rows.row(k);
    const Eigen::Vector3d l_a = R_a_k * l;
    const Eigen::Vector3d l_cell = R_body_cell.transpose() * l_a;
    J_seen.row(k + 1) << 0, 0, 0, l.cross(g_k).transpose();
    J_carrier.row(k + 1) << 0, 0, 0, g_a.cross(l_a).transpose();
    J_surfel.row(k + 1) << 0, -l_cell.x(), -l_cell.y();
  }
}

SurfelParentTerm::SurfelParentTerm(const SurfelParentFactor& f, const SE3& T_body_cell,
                                   const Eigen::Vector3d& anchor)
    : R_body_cell(T_body_cell.so3().matrix()),
      t_body_cell(T_body_cell.translation()),
      anchor_map(anchor),
      inverse_sigma_height(1.0 / f.sigma_height),
      inverse_sigma_slope(1.0 / f.sigma_slope) {}

void SurfelParentTerm::evaluate(const PoseState& carrier, const PlaneState& plane,
                                const FlatState& surfel, Eigen::Vector3d& residual,
                                Jacobians* J) const {
  const Eigen::Vector3d x_body = t_body_cell + R_body_cell.col(2) * surfel.x.x();
  const Eigen::Vector3d arm = carrier.R * x_body + (carrier.t - anchor_map);
  const Eigen::Vector3d n_body = carrier.R.transpose() * plane.n;
  const Eigen::Vector3d n_cell = R_body_cell.transpose() * n_body;
  const Eigen::Vector2d slope = surfel.x.tail<2>();
  residual(0) = inverse_sigma_height * (plane.n.dot(arm) - plane.rho);
  residual.tail<2>() = inverse_sigma_slope * (n_cell.head<2>() + slope * n_cell.z());
  if (J == nullptr) return;
  auto& [J_pose, J_plane, J_surfel] = *J;
  // Rows 1, 2 are P n_cell with P = (I, slope), 2x3.
  Eigen::Matrix<double, 2, 3> P;
  P << 1, 0, slope.x(), 0, 1, slope.y();
  const Eigen::Matrix<double, 2, 3> P_body = inverse_sigma_slope * P * R_body_cell.transpose();
  J_pose.row(0) << n_body.transpose(), x_body.cross(n_body).transpose();
  J_pose.row(0) *= inverse_sigma_height;
  J_pose.bottomLeftCorner<2, 3>().setZero();
  J_pose.bottomRightCorner<2, 3>() = P_body * SO3::hat(n_body);
  J_plane.row(0) << arm.transpose() * plane.B, -1;
  J_plane.row(0) *= inverse_sigma_height;
  J_plane.bottomLeftCorner<2, 2>() = P_body * carrier.R.transpose() * plane.B;
  J_plane.bottomRightCorner<2, 1>().setZero();
  J_surfel.setZero();
  J_surfel(0, 0) = inverse_sigma_height * n_cell.z();
  J_surfel(1, 1) = J_surfel(2, 2) = inverse_sigma_slope * n_cell.z();
}

}  // namespace lamina
