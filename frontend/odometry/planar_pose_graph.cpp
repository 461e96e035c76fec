// Gauss-Newton over planar poses with a sparse Cholesky factorisation.
#include <lamina/frontend/odometry/planar_pose_graph.hpp>

#include <Eigen/SparseCholesky>
#include <algorithm>

namespace lamina {
namespace {

// Cauchy's kernel: a loop three sigmas off in each direction has half its weight.
constexpr double kCauchySquared = 27.0;

Eigen::Vector3d residual(const PlanarEdge& e, const PlanarPose& from, const PlanarPose& to) {
  const PlanarPose d = e.T_from_to.inverse() * (from.inverse() * to);
  return {d.x, d.y, d.yaw};
}

using Cholesky = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>;

// Every pose's own covariance: the inverse where the factor has entries, column by column from the
// last, Z_ij = [i = j] / d_j - sum_k>j Z_ik L_kj [Takahashi1973]. As cheap as the factorisation.
class PoseCovariances {
 public:
  explicit PoseCovariances(const Cholesky& cholesky)
      : place_(cholesky.permutationP().indices()), L_(cholesky.matrixL().nestedExpression()) {
    const Eigen::VectorXd D = cholesky.vectorD();
    L_.prune([](auto row, auto column, double) { return row > column; });
    Z_ = L_;
    diagonal_ = Eigen::VectorXd::Zero(D.size());
    Eigen::VectorXd l = Eigen::VectorXd::Zero(D.size());            // column j of L,
    Eigen::VectorXd z = Eigen::VectorXd::Zero(D.size());            // and of Z, below the diagonal
    std::vector<char> held(static_cast<std::size_t>(D.size()), 0);  // rows that it has
    for (int j = static_cast<int>(D.size()) - 1; j >= 0; --j) {
      for (Iterator it(L_, j); it; ++it) {
        l[it.row()] = it.value();
        held[static_cast<std::size_t>(it.row())] = 1;
      }
      for (Iterator it(L_, j); it; ++it) {
        const auto k = it.row();
        z[k] -= diagonal_[k] * l[k];
        for (Iterator below(Z_, k); below; ++below) {
          const auto i = below.row();
          if (!held[static_cast<std::size_t>(i)]) continue;
          z[i] -= below.value() * l[k];
          z[k] -= below.value() * l[i];
        }
      }
      diagonal_[j] = 1 / D[j];
      for (Iterator it(Z_, j); it; ++it) {
        const auto i = it.row();
        it.valueRef() = z[i];
        diagonal_[j] -= z[i] * l[i];
        z[i] = l[i] = 0;
        held[static_cast<std::size_t>(i)] = 0;
      }
    }
  }

  /// Zero for node 0, which is fixed.
  Eigen::Matrix3d of(int node) const {
    Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
    if (node == 0) return C;
    for (int a = 0; a < 3; ++a) {
      for (int b = a; b < 3; ++b) {
        const int i = place_[3 * (node - 1) + a], j = place_[3 * (node - 1) + b];
        C(a, b) = C(b, a) = i == j ? diagonal_[i] : Z_.coeff(std::max(i, j), std::min(i, j));
      }
    }
    return C;
  }

 private:
  using Iterator = Eigen::SparseMatrix<double>::InnerIterator;
  Eigen::VectorXi place_;  // of each unknown in the factor
  Eigen::SparseMatrix<double> L_, Z_;
  Eigen::VectorXd diagonal_;  // of Z
};

}  // namespace

struct PlanarPoseGraph::Solver {
  Cholesky cholesky;
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
  const auto rows = [](const Eigen::MatrixXd& m, int node) -> Eigen::Matrix3d {
    return node > 0 ? Eigen::Matrix3d(m.middleRows<3>(3 * (node - 1))) : Eigen::Matrix3d::Zero();
  };
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(n, 3);
  if (to > 0) unit.middleRows<3>(3 * (to - 1)).setIdentity();
  const Eigen::MatrixXd to_columns = solver_->cholesky.solve(unit);
  const PoseCovariances own(solver_->cholesky);
  for (std::size_t k = 0; k < from.size(); ++k) {
    const Eigen::Matrix3d J = -(pose(to).inverse() * pose(from[k])).adjoint();
    const Eigen::Matrix3d cross = rows(to_columns, from[k]);
    result[k] = J * own.of(from[k]) * J.transpose() + J * cross +
                cross.transpose() * J.transpose() + rows(to_columns, to);
  }
  return result;
}

}  // namespace lamina
