// Covariances of the window and its prior, in the tangents of Plane.
#include <lamina/backend/solver/window/sliding_window.hpp>

#include <lamina/models/error.hpp>

namespace lamina {

// From the chart's basis to Plane::tangent_basis().
static Eigen::Matrix3d to_plane_tangent(const Eigen::Vector3d& normal, const Matrix32d& basis) {
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J.topLeftCorner<2, 2>() = Plane::tangent_basis(normal).transpose() * basis;
  return J;
}

Eigen::Matrix3d SlidingWindow::plane_covariance(int plane) const {
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(system_.columns(), 3);
  const int column = system_.plane_column(plane);
  unit.middleRows<3>(column).setIdentity();
  const Eigen::Matrix3d C = system_.solve(unit).middleRows<3>(column);
  const Chart& chart = planes_[static_cast<std::size_t>(plane)].now;
  const Eigen::Matrix3d J = to_plane_tangent(chart.normal, chart.basis);
  return J * (0.5 * (C + C.transpose())) * J.transpose();
}

Matrix6d SlidingWindow::newest_covariance() const {
  LAMINA_CHECK(solved_ && !poses_.empty());
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(system_.columns(), 6);
  const int column = 6 * (static_cast<int>(poses_.size()) - 1);
  unit.middleRows<6>(column).setIdentity();
  const Matrix6d C = system_.solve(unit).middleRows<6>(column);
  return 0.5 * (C + C.transpose());
}

std::optional<Eigen::Matrix<double, 9, 9>> SlidingWindow::joint_covariance(PlaneId id) const {
  const int plane = find(id);
  if (!solved_ || plane < 0 || poses_.empty()) return std::nullopt;
  const int a = 6 * (static_cast<int>(poses_.size()) - 1), b = system_.plane_column(plane);
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(system_.columns(), 9);
  unit.block<6, 6>(a, 0).setIdentity();
  unit.block<3, 3>(b, 6).setIdentity();
  const Eigen::MatrixXd X = system_.solve(unit);
  Eigen::Matrix<double, 9, 9> C;
  C.topRows<6>() = X.middleRows<6>(a);
  C.bottomRows<3>() = X.middleRows<3>(b);
  const Chart& chart = planes_[static_cast<std::size_t>(plane)].now;
  Eigen::Matrix<double, 9, 9> J = Eigen::Matrix<double, 9, 9>::Identity();
  J.bottomRightCorner<3, 3>() = to_plane_tangent(chart.normal, chart.basis);
  return J * (0.5 * (C + C.transpose())) * J.transpose();
}

std::vector<std::pair<PlaneId, Eigen::Matrix<double, 9, 9>>> SlidingWindow::joint_covariances(
    const std::vector<PlaneId>& ids) const {
  std::vector<std::pair<PlaneId, Eigen::Matrix<double, 9, 9>>> result;
  if (!solved_ || poses_.empty()) return result;
  const int a = 6 * (static_cast<int>(poses_.size()) - 1);
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(system_.columns(), 6);
  unit.middleRows<6>(a).setIdentity();
  const Eigen::MatrixXd X = system_.solve(unit);
  for (const PlaneId id : ids) {
    const int plane = find(id);
    if (plane < 0) continue;
    const Chart& chart = planes_[static_cast<std::size_t>(plane)].now;
    const Eigen::Matrix3d J = to_plane_tangent(chart.normal, chart.basis);
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
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    const Eigen::Matrix3d J = to_plane_tangent(planes_[i].now.normal, planes_[i].now.basis);
    blocks.planes[i] = J * blocks.planes[i] * J.transpose();
  }
  return {std::move(blocks.poses), std::move(blocks.planes), system_.held()};
}

Eigen::MatrixXd SlidingWindow::covariance() const {
  LAMINA_CHECK(solved_);
  Eigen::MatrixXd C =
      system_.solve(Eigen::MatrixXd::Identity(system_.columns(), system_.columns()));
  C = (0.5 * (C + C.transpose())).eval();
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    const Eigen::Matrix3d J = to_plane_tangent(planes_[i].now.normal, planes_[i].now.basis);
    const int column = system_.plane_column(static_cast<int>(i));
    C.middleRows<3>(column) = (J * C.middleRows<3>(column)).eval();
    C.middleCols<3>(column) = (C.middleCols<3>(column) * J.transpose()).eval();
  }
  return C;
}

MarginalPrior SlidingWindow::prior() const {
  MarginalPrior result;
  result.keyframes = prior_.poses;
  result.poses_linear = prior_.poses_at;
  result.planes = prior_.planes;
  result.sqrt_information = prior_.R;
  result.residual = prior_.r;
  for (std::size_t i = 0; i < prior_.planes_at.size(); ++i) {
    const Chart& chart = prior_.planes_at[i];
    result.planes_linear.emplace_back(chart.normal, chart.rho);
    const auto column = static_cast<Eigen::Index>(6 * prior_.poses.size() + 3 * i);
    const Eigen::Matrix3d J = to_plane_tangent(chart.normal, chart.basis);
    result.sqrt_information.middleCols<3>(column) =
        (prior_.R.middleCols<3>(column) * J.transpose()).eval();
  }
  return result;
}

}  // namespace lamina
