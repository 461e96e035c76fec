// Gauss-Newton over planar poses with a sparse Cholesky factorisation.
#include <lamina/frontend/loops/planar_pose_graph.hpp>

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

  /// Of the pose that is the unknown of this number; zero for one that is not estimated (-1).
  Eigen::Matrix3d of(int unknown) const {
    Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
    if (unknown < 0) return C;
    for (int a = 0; a < 3; ++a) {
      for (int b = a; b < 3; ++b) {
        const int i = place_[3 * unknown + a], j = place_[3 * unknown + b];
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

double PlanarPoseGraph::weight(const PlanarEdge& edge) const {
  return edge.robust ? 1 / (1 + chi_squared(edge) / kCauchySquared) : 1.0;
}

void PlanarPoseGraph::remove_node(int node) {
  std::erase_if(edges_, [node](const PlanarEdge& e) { return e.from == node || e.to == node; });
  const auto at = std::lower_bound(removed_.begin(), removed_.end(), node);
  if (at == removed_.end() || *at != node) removed_.insert(at, node);
}

PlanarPoseGraph::Unknowns PlanarPoseGraph::unknowns() const {
  Unknowns result;
  result.of.assign(poses_.size(), -1);
  auto removed = removed_.begin();
  for (int node = 0; node < static_cast<int>(poses_.size()); ++node) {
    const bool gone = removed != removed_.end() && *removed == node;
    if (gone) ++removed;
    if (node > 0 && !gone) result.of[static_cast<std::size_t>(node)] = result.count++;
  }
  return result;
}

double PlanarPoseGraph::chi_squared(const PlanarEdge& edge) const {
  const Eigen::Vector3d r = residual(edge, pose(edge.from), pose(edge.to));
  return r.dot(edge.information * r);
}

bool PlanarPoseGraph::factorise(const Unknowns& unknowns, Eigen::VectorXd* gradient) const {
  const Eigen::Index n = 3 * unknowns.count;
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(edges_.size() * 36);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
  const auto block = [&](int a, int b, const Eigen::Matrix3d& M) {
    if (a < 0 || b < 0) return;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) entries.emplace_back(3 * a + i, 3 * b + j, M(i, j));
    }
  };
  for (const PlanarEdge& e : edges_) {
    const PlanarPose T = pose(e.from).inverse() * pose(e.to);
    const Eigen::Vector3d r = residual(e, pose(e.from), pose(e.to));
    // d = measured^-1 from^-1 to: a step of `to` adds as it is, one of `from` as -Ad(T^-1). The
    // rotation of small residuals is taken as identity.
    const Eigen::Matrix3d J = -T.inverse().adjoint();
    const Eigen::Matrix3d W = weight(e) * e.information;
    const int from = unknowns.of[static_cast<std::size_t>(e.from)],
              to = unknowns.of[static_cast<std::size_t>(e.to)];
    block(from, from, J.transpose() * W * J);
    block(from, to, J.transpose() * W);
    block(to, from, W * J);
    block(to, to, W);
    if (from >= 0) g.segment<3>(3 * from) += J.transpose() * W * r;
    if (to >= 0) g.segment<3>(3 * to) += W * r;
  }
  Eigen::SparseMatrix<double> H(n, n);
  H.setFromTriplets(entries.begin(), entries.end());
  solver_->cholesky.compute(H);
  if (gradient) *gradient = g;
  return solver_->cholesky.info() == Eigen::Success;
}

bool PlanarPoseGraph::optimise(int iterations) {
  const Unknowns unknowns = this->unknowns();
  if (unknowns.count == 0) return true;
  for (int i = 0; i < iterations; ++i) {
    Eigen::VectorXd g;
    if (!factorise(unknowns, &g)) return false;
    const Eigen::VectorXd d = solver_->cholesky.solve(-g);
    if (!d.allFinite()) return false;
    for (std::size_t k = 1; k < poses_.size(); ++k) {
      if (unknowns.of[k] >= 0) poses_[k] = poses_[k].boxplus(d.segment<3>(3 * unknowns.of[k]));
    }
    if (d.lpNorm<Eigen::Infinity>() < 1e-5) return true;
  }
  return false;
}

std::vector<Eigen::Matrix3d> PlanarPoseGraph::relative_covariances(const std::vector<int>& from,
                                                                   int to) const {
  std::vector<Eigen::Matrix3d> result(from.size(), Eigen::Matrix3d::Zero());
  const Unknowns unknowns = this->unknowns();
  if (unknowns.count == 0 || !factorise(unknowns, nullptr)) return result;
  const auto unknown = [&](int node) { return unknowns.of[static_cast<std::size_t>(node)]; };
  const auto rows = [&](const Eigen::MatrixXd& m, int node) -> Eigen::Matrix3d {
    const int k = unknown(node);
    return k >= 0 ? Eigen::Matrix3d(m.middleRows<3>(3 * k)) : Eigen::Matrix3d::Zero();
  };
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(3 * unknowns.count, 3);
  if (unknown(to) >= 0) unit.middleRows<3>(3 * unknown(to)).setIdentity();
  const Eigen::MatrixXd to_columns = solver_->cholesky.solve(unit);
  const PoseCovariances own(solver_->cholesky);
  for (std::size_t k = 0; k < from.size(); ++k) {
    const Eigen::Matrix3d J = -(pose(to).inverse() * pose(from[k])).adjoint();
    const Eigen::Matrix3d cross = rows(to_columns, from[k]);
    result[k] = J * own.of(unknown(from[k])) * J.transpose() + J * cross +
                cross.transpose() * J.transpose() + rows(to_columns, to);
  }
  return result;
}

}  // namespace lamina
