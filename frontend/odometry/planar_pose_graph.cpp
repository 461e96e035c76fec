// Gauss-Newton over planar poses with a sparse Cholesky factorisation.
#include <lamina/frontend/odometry/planar_pose_graph.hpp>

#include <Eigen/SparseCholesky>

namespace lamina {
namespace {

// Cauchy's kernel: a loop three sigmas off in each direction has half its weight.
constexpr double kCauchySquared = 27.0;

Eigen::Vector3d residual(const PlanarEdge& e, const PlanarPose& from, const PlanarPose& to) {
  const PlanarPose d = e.T_from_to.inverse() * (from.inverse() * to);
  return {d.x, d.y, d.yaw};
}

}  // namespace

struct PlanarPoseGraph::Solver {
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> cholesky;
};

PlanarPoseGraph::PlanarPoseGraph() : solver_(std::make_unique<Solver>()) {}
PlanarPoseGraph::~PlanarPoseGraph() = default;
PlanarPoseGraph::PlanarPoseGraph(PlanarPoseGraph&&) noexcept = default;
PlanarPoseGraph& PlanarPoseGraph::operator=(PlanarPoseGraph&&) noexcept = default;

int PlanarPoseGraph::add_node(const PlanarPose& T_map_node) {
  poses_.push_back(T_map_node);
  return static_cast<int>(poses_.size()) - 1;
}

double PlanarPoseGraph::chi_squared(const PlanarEdge& edge) const {
  const Eigen::Vector3d r = residual(edge, pose(edge.from), pose(edge.to));
  return r.dot(edge.information * r);
}

bool PlanarPoseGraph::factorise(Eigen::VectorXd* gradient) const {
  const Eigen::Index n = 3 * (static_cast<Eigen::Index>(poses_.size()) - 1);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(edges_.size() * 36);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
  const auto block = [&](int a, int b, const Eigen::Matrix3d& M) {
    if (a == 0 || b == 0) return;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) entries.emplace_back(3 * (a - 1) + i, 3 * (b - 1) + j, M(i, j));
    }
  };
  for (const PlanarEdge& e : edges_) {
    const PlanarPose T = pose(e.from).inverse() * pose(e.to);
    const Eigen::Vector3d r = residual(e, pose(e.from), pose(e.to));
    const double weight = e.robust ? 1 / (1 + r.dot(e.information * r) / kCauchySquared) : 1.0;
    // d = measured^-1 from^-1 to: a step of `to` adds as it is, one of `from` as -Ad(T^-1). The
    // rotation of small residuals is taken as identity.
    const Eigen::Matrix3d J = -T.inverse().adjoint();
    const Eigen::Matrix3d W = weight * e.information;
    block(e.from, e.from, J.transpose() * W * J);
    block(e.from, e.to, J.transpose() * W);
    block(e.to, e.from, W * J);
    block(e.to, e.to, W);
    if (e.from > 0) g.segment<3>(3 * (e.from - 1)) += J.transpose() * W * r;
    if (e.to > 0) g.segment<3>(3 * (e.to - 1)) += W * r;
  }
  Eigen::SparseMatrix<double> H(n, n);
  H.setFromTriplets(entries.begin(), entries.end());
  solver_->cholesky.compute(H);
  if (gradient) *gradient = g;
  return solver_->cholesky.info() == Eigen::Success;
}

bool PlanarPoseGraph::optimise(int iterations) {
  if (poses_.size() < 2) return true;
  for (int i = 0; i < iterations; ++i) {
    Eigen::VectorXd g;
    if (!factorise(&g)) return false;
    const Eigen::VectorXd d = solver_->cholesky.solve(-g);
    if (!d.allFinite()) return false;
    for (std::size_t k = 1; k < poses_.size(); ++k) {
      poses_[k] = poses_[k].boxplus(d.segment<3>(3 * (static_cast<Eigen::Index>(k) - 1)));
    }
    if (d.lpNorm<Eigen::Infinity>() < 1e-5) return true;
  }
  return false;
}

std::vector<Eigen::Matrix3d> PlanarPoseGraph::relative_covariances(const std::vector<int>& from,
                                                                   int to) const {
  std::vector<Eigen::Matrix3d> result(from.size(), Eigen::Matrix3d::Zero());
  if (poses_.size() < 2 || !factorise(nullptr)) return result;
  const Eigen::Index n = 3 * (static_cast<Eigen::Index>(poses_.size()) - 1);
  const auto columns = [&](int node) -> Eigen::MatrixXd {
    Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(n, 3);
    if (node > 0) unit.middleRows<3>(3 * (node - 1)).setIdentity();
    return solver_->cholesky.solve(unit);
  };
  const auto rows = [](const Eigen::MatrixXd& m, int node) -> Eigen::Matrix3d {
    return node > 0 ? Eigen::Matrix3d(m.middleRows<3>(3 * (node - 1))) : Eigen::Matrix3d::Zero();
  };
  const Eigen::MatrixXd to_columns = columns(to);
  for (std::size_t k = 0; k < from.size(); ++k) {
    const Eigen::MatrixXd from_columns = columns(from[k]);
    const Eigen::Matrix3d J = -(pose(to).inverse() * pose(from[k])).adjoint();
    const Eigen::Matrix3d cross = rows(to_columns, from[k]);
    result[k] = J * rows(from_columns, from[k]) * J.transpose() + J * cross +
                cross.transpose() * J.transpose() + rows(to_columns, to);
  }
  return result;
}

}  // namespace lamina
