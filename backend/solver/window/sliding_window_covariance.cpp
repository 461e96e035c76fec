// Covariances of the window and its prior, in the tangents of Plane.
#include <lamina/backend/solver/window/sliding_window.hpp>

#include <lamina/models/error.hpp>

namespace lamina {

// From the plane's own basis to Plane::tangent_basis().
static Eigen::Matrix3d to_plane_tangent(const PlaneState& plane) {
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J.topLeftCorner<2, 2>() = Plane::tangent_basis(plane.n).transpose() * plane.B;
  return J;
}

Eigen::Matrix3d SlidingWindow::plane_covariance(int plane) const {
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(system_.columns(), 3);
  const int column = system_.plane_column(plane);
  unit.middleRows<3>(column).setIdentity();
  const Eigen::Matrix3d C = system_.solve(unit).middleRows<3>(column);
  const Eigen::Matrix3d J = to_plane_tangent(state_.planes[static_cast<std::size_t>(plane)].now);
  return J * (0.5 * (C + C.transpose())) * J.transpose();
}

Matrix6d SlidingWindow::newest_covariance() const {
  LAMINA_CHECK(solved_ && !state_.poses.empty());
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(system_.columns(), 6);
  const int column = 6 * (static_cast<int>(state_.poses.size()) - 1);
  unit.middleRows<6>(column).setIdentity();
  const Matrix6d C = system_.solve(unit).middleRows<6>(column);
  return 0.5 * (C + C.transpose());
}

std::optional<Eigen::Matrix<double, 9, 9>> SlidingWindow::joint_covariance(PlaneId id) const {
  const int plane = find(id);
  if (!solved_ || plane < 0 || state_.poses.empty()) return std::nullopt;
  const int a = 6 * (static_cast<int>(state_.poses.size()) - 1), b = system_.plane_column(plane);
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(system_.columns(), 9);
  unit.block<6, 6>(a, 0).setIdentity();
  unit.block<3, 3>(b, 6).setIdentity();
  const Eigen::MatrixXd X = system_.solve(unit);
  Eigen::Matrix<double, 9, 9> C;
  C.topRows<6>() = X.middleRows<6>(a);
  C.bottomRows<3>() = X.middleRows<3>(b);
  Eigen::Matrix<double, 9, 9> J = Eigen::Matrix<double, 9, 9>::Identity();
  J.bottomRightCorner<3, 3>() =
      to_plane_tangent(state_.planes[static_cast<std::size_t>(plane)].now);
  return J * (0.5 * (C + C.transpose())) * J.transpose();
}

std::vector<std::pair<PlaneId, Eigen::Matrix<double, 9, 9>>> SlidingWindow::joint_covariances(
    const std::vector<PlaneId>& ids) const {
  std::vector<std::pair<PlaneId, Eigen::Matrix<double, 9, 9>>> result;
  if (!solved_ || state_.poses.empty()) return result;
  const int a = 6 * (static_cast<int>(state_.poses.size()) - 1);
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(system_.columns(), 6);
  unit.middleRows<6>(a).setIdentity();
  const Eigen::MatrixXd X = system_.solve(unit);
  for (const PlaneId id : ids) {
    const int plane = find(id);
    if (plane < 0) continue;
    const Eigen::Matrix3d J = to_plane_tangent(state_.planes[static_cast<std::size_t>(plane)].now);
    Eigen::Matrix<double, 9, 9> C;
    C.topLeftCorner<6, 6>() = X.middleRows<6>(a);
    C.bottomLeftCorner<3, 6>() = J * X.middleRows<3>(system_.plane_column(plane));
    C.topRightCorner<6, 3>() = C.bottomLeftCorner<3, 6>().transpose();
    C.bottomRightCorner<3, 3>() = J * system_.plane_block(plane) * J.transpose();
    result.emplace_back(id, 0.5 * (C + C.transpose()));
  }
  return result;
}

WindowCovariances SlidingWindow::covariances() const {
  LAMINA_CHECK(solved_);
  WindowSystem::Blocks blocks = system_.inverse_blocks();
  for (std::size_t i = 0; i < state_.planes.size(); ++i) {
    const Eigen::Matrix3d J = to_plane_tangent(state_.planes[i].now);
    blocks.planes[i] = J * blocks.planes[i] * J.transpose();
  }
  return {std::move(blocks.poses), std::move(blocks.planes), system_.held()};
}

Eigen::MatrixXd SlidingWindow::covariance() const {
  LAMINA_CHECK(solved_);
  Eigen::MatrixXd C =
      system_.solve(Eigen::MatrixXd::Identity(system_.columns(), system_.columns()));
  C = (0.5 * (C + C.transpose())).eval();
  for (std::size_t i = 0; i < state_.planes.size(); ++i) {
    const Eigen::Matrix3d J = to_plane_tangent(state_.planes[i].now);
    const int column = system_.plane_column(static_cast<int>(i));
    C.middleRows<3>(column) = (J * C.middleRows<3>(column)).eval();
    C.middleCols<3>(column) = (C.middleCols<3>(column) * J.transpose()).eval();
  }
  return C;
}

MarginalPrior SlidingWindow::prior() const {
  MarginalPrior result;
  result.keyframes = state_.prior.poses;
  result.poses_linear = state_.prior.poses_at;
  result.planes = state_.prior.planes;
  result.sqrt_information = state_.prior.R;
  result.residual = state_.prior.r;
  for (std::size_t i = 0; i < state_.prior.planes_at.size(); ++i) {
    result.planes_linear.push_back(state_.prior.planes_at[i].plane());
    const auto column = static_cast<Eigen::Index>(6 * state_.prior.poses.size() + 3 * i);
    const Eigen::Matrix3d J = to_plane_tangent(state_.prior.planes_at[i]);
    result.sqrt_information.middleCols<3>(column) =
        (state_.prior.R.middleCols<3>(column) * J.transpose()).eval();
  }
  return result;
}

}  // namespace lamina
