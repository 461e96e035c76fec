// Schur complements of 3x3 blocks.
#include <lamina/backend/solver/window/surfel_elimination.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>

namespace lamina::window {
namespace {

// The rows of one surfel, linear about the present states.
struct Rows {
  struct Seen {
    int pose;
    Eigen::Vector4d r;
    Eigen::Matrix<double, 4, 6> J_pose;
    Eigen::Matrix<double, 4, 3> J_surfel;
  };
  std::vector<Seen> seen;
  int parent = -1;
  Eigen::Vector3d r_parent = Eigen::Vector3d::Zero();
  Eigen::Matrix3d J_parent = Eigen::Matrix3d::Zero(), J_surfel = Eigen::Matrix3d::Zero();
  double weight = 0;  // of the parent, robust
};

const PoseState& map_frame() {
  static const PoseState identity;
  return identity;
}

Rows rows_of(const Surfel& surfel, const State& state) {
  Rows rows;
  for (const SurfelView& view : surfel.views) {
    Rows::Seen& seen = rows.seen.emplace_back();
    seen.pose = state.find(view.keyframe);
    const Pose& pose = state.poses[static_cast<std::size_t>(seen.pose)];
    SurfelMomentsTerm::Jacobians J;
    if (pose.frozen) {
      view.term.evaluate(pose.first, map_frame(), surfel.now, seen.r, &J);
      view.term.evaluate(pose.now, map_frame(), surfel.now, seen.r, nullptr);
    } else {
      view.term.evaluate(pose.now, map_frame(), surfel.now, seen.r, &J);
    }
    seen.J_pose = std::get<0>(J);
    seen.J_surfel = std::get<2>(J);
  }
  rows.parent = state.find(surfel.parent);
  if (rows.parent < 0) return rows;
  const Landmark& plane = state.planes[static_cast<std::size_t>(rows.parent)];
  SurfelParentTerm::Jacobians J;
  if (plane.frozen) {
    surfel.tie.evaluate(map_frame(), plane.first, surfel.now, rows.r_parent, &J);
    surfel.tie.evaluate(map_frame(), plane.now, surfel.now, rows.r_parent, nullptr);
  } else {
    surfel.tie.evaluate(map_frame(), plane.now, surfel.now, rows.r_parent, &J);
  }
  rows.J_parent = std::get<1>(J);
  rows.J_surfel = std::get<2>(J);
  return rows;
}

// Cauchy's weight and cost of a parent's residual.
double cauchy_weight(double chi_squared) {
  return 1 / (1 + chi_squared / (kSurfelParentScale * kSurfelParentScale));
}
double cauchy_cost(double chi_squared) {
  const double square = kSurfelParentScale * kSurfelParentScale;
  return square * std::log1p(chi_squared / square);
}

// To where the surfel fits best; the root of its information. nullopt: nothing holds it.
std::optional<Eigen::Matrix3d> settle(Rows& rows, Surfel& surfel) {
  Eigen::Matrix3d H_seen = Eigen::Matrix3d::Zero(), root;
  for (const auto& seen : rows.seen) H_seen.noalias() += seen.J_surfel.transpose() * seen.J_surfel;
  for (int round = 0; round < 3; ++round) {
    if (rows.parent >= 0) rows.weight = cauchy_weight(rows.r_parent.squaredNorm());
    const Eigen::Matrix3d H = H_seen + rows.weight * rows.J_surfel.transpose() * rows.J_surfel;
    Eigen::Vector3d b = rows.weight * rows.J_surfel.transpose() * rows.r_parent;
    for (const auto& seen : rows.seen) b.noalias() += seen.J_surfel.transpose() * seen.r;
    const Eigen::LLT<Eigen::Matrix3d> llt(H);
    if (llt.info() != Eigen::Success) return std::nullopt;
    const Eigen::Vector3d step = -llt.solve(b);
    if (!step.allFinite()) return std::nullopt;
    surfel.now = surfel.now.plus(step);
    for (auto& seen : rows.seen) seen.r.noalias() += seen.J_surfel * step;
    rows.r_parent += rows.J_surfel * step;
    root = llt.matrixL();
    if (rows.parent < 0) break;
  }
  return root;
}

// Where the columns of what surfels see and hang on are, in a system of these alone.
struct Columns {
  std::vector<int> pose, plane;  // by place in the state; -1: not there
  std::vector<int> all;          // columns of the whole system

  Columns(const State& state, const std::vector<Rows>& rows)
      : pose(state.poses.size(), -1), plane(state.planes.size(), -1) {
    for (const Rows& of : rows) {
      for (const auto& seen : of.seen) pose[static_cast<std::size_t>(seen.pose)] = 0;
      if (of.parent >= 0) plane[static_cast<std::size_t>(of.parent)] = 0;
    }
    const auto number = [this](std::vector<int>& marked, int size, int first) {
      for (std::size_t i = 0; i < marked.size(); ++i) {
        if (marked[i] < 0) continue;
        marked[i] = static_cast<int>(all.size());
        for (int k = 0; k < size; ++k) all.push_back(first + size * static_cast<int>(i) + k);
      }
    };
    number(pose, 6, 0);
    number(plane, 3, 6 * static_cast<int>(state.poses.size()));
  }
};

void add_gradient(const Rows& rows, const Columns& columns, Eigen::VectorXd& g) {
  for (const auto& seen : rows.seen) {
    g.segment<6>(columns.pose[static_cast<std::size_t>(seen.pose)]).noalias() +=
        seen.J_pose.transpose() * seen.r;
  }
  if (rows.parent < 0) return;
  g.segment<3>(columns.plane[static_cast<std::size_t>(rows.parent)]).noalias() +=
      rows.weight * rows.J_parent.transpose() * rows.r_parent;
}

// Upper blocks of the Schur complement; A = root^-1 J_surfel^T J of each state.
void add_information(const Rows& rows, const Eigen::Matrix3d& root, const Columns& columns,
                     Eigen::MatrixXd& H) {
  using Coupling = Eigen::Matrix<double, 3, 6>;
  std::vector<std::pair<int, Coupling>> couplings;
  const auto solve = root.triangularView<Eigen::Lower>();
  for (const auto& seen : rows.seen) {
    const int at = columns.pose[static_cast<std::size_t>(seen.pose)];
    H.block<6, 6>(at, at).noalias() += seen.J_pose.transpose() * seen.J_pose;
    couplings.emplace_back(at, solve.solve(Coupling(seen.J_surfel.transpose() * seen.J_pose)));
  }
  std::sort(couplings.begin(), couplings.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t i = 0; i < couplings.size(); ++i) {
    for (std::size_t j = i; j < couplings.size(); ++j) {
      H.block<6, 6>(couplings[i].first, couplings[j].first).noalias() -=
          couplings[i].second.transpose() * couplings[j].second;
    }
  }
  if (rows.parent < 0) return;
  const int at = columns.plane[static_cast<std::size_t>(rows.parent)];
  const Eigen::Matrix3d tie =
      solve.solve(Eigen::Matrix3d(rows.weight * rows.J_surfel.transpose() * rows.J_parent));
  H.block<3, 3>(at, at).noalias() +=
      rows.weight * rows.J_parent.transpose() * rows.J_parent - tie.transpose() * tie;
  for (const auto& [pose, coupling] : couplings)
    H.block<6, 3>(pose, at).noalias() -= coupling.transpose() * tie;
}

}  // namespace

SurfelInformation eliminate_surfels(State& state, const std::function<bool(const Surfel&)>& taken,
                                    bool gradient_alone) {
  std::vector<Rows> all;
  std::vector<Eigen::Matrix3d> roots;
  SurfelInformation result;
  for (Surfel& surfel : state.surfels) {
    if (!taken(surfel)) continue;
    Rows rows = rows_of(surfel, state);
    const auto root = settle(rows, surfel);
    if (!root) continue;
    for (const auto& seen : rows.seen) result.cost += seen.r.squaredNorm();
    if (rows.parent >= 0) result.cost += cauchy_cost(rows.r_parent.squaredNorm());
    all.push_back(std::move(rows));
    roots.push_back(*root);
  }
  const Columns columns(state, all);
  const auto size = static_cast<Eigen::Index>(columns.all.size());
  result.g = Eigen::VectorXd::Zero(size);
  if (!gradient_alone) result.H = Eigen::MatrixXd::Zero(size, size);
  for (std::size_t i = 0; i < all.size(); ++i) {
    add_gradient(all[i], columns, result.g);
    if (!gradient_alone) add_information(all[i], roots[i], columns, result.H);
  }
  if (!gradient_alone)
    result.H.triangularView<Eigen::StrictlyLower>() = result.H.transpose().eval();
  result.columns = columns.all;
  return result;
}

LinearFactor surfel_factor(const SurfelInformation& information, const State& state) {
  LinearFactor factor;
  const Eigen::Index size = information.g.size();
  if (size == 0) return factor;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information.H);
  const double least = 1e-10 * std::max(0.0, eigen.eigenvalues()(size - 1));
  Eigen::Index first = 0;
  while (first < size && !(eigen.eigenvalues()(first) > least)) ++first;
  const Eigen::Index rows = size - first;
  const Eigen::VectorXd sigma = eigen.eigenvalues().tail(rows).cwiseSqrt();
  const auto basis = eigen.eigenvectors().rightCols(rows);
  const Eigen::MatrixXd R = sigma.asDiagonal() * basis.transpose();
  factor.residual = sigma.cwiseInverse().asDiagonal() * (basis.transpose() * information.g);
  const int border = 6 * static_cast<int>(state.poses.size());
  for (Eigen::Index column = 0; column < size;) {
    const int at = information.columns[static_cast<std::size_t>(column)];
    const bool pose = at < border;
    factor.variables.push_back(pose ? at / 6
                                    : static_cast<int>(state.poses.size()) + (at - border) / 3);
    factor.jacobians.push_back(R.middleCols(column, pose ? 6 : 3));
    column += pose ? 6 : 3;
  }
  return factor;
}

}  // namespace lamina::window
