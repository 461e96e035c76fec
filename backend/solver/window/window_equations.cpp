// The window's factors at their linearisation point: into the equations of a solve, or one by one
// for an elimination.
#include <lamina/backend/solver/window/window_equations.hpp>

#include <algorithm>
#include <cmath>

namespace lamina::window {

namespace {

double robust_weight(double chi_squared, double bound) {
  return chi_squared <= bound ? 1.0 : std::sqrt(bound / chi_squared);
}

double huber(double chi_squared, double weight) {
  return weight >= 1.0 ? chi_squared : chi_squared * weight * (2.0 - weight);
}

// First estimates: where the marginal prior holds a state, all Jacobians are taken at one point.
template <class State>
const auto& linearization_point(const State& state) {
  return state.frozen ? state.first : state.now;
}

// Where each id stands in a list: many are asked for.
template <class States>
auto positions(const States& states) {
  using Id = decltype(states.front().id);
  std::vector<std::pair<Id, int>> sorted;
  for (const auto& state : states) sorted.emplace_back(state.id, static_cast<int>(sorted.size()));
  std::sort(sorted.begin(), sorted.end());
  return [sorted = std::move(sorted)](Id id) {
    return std::lower_bound(sorted.begin(), sorted.end(), std::pair(id, 0))->second;
  };
}

// A term's residual at the present states, its Jacobians at the linearisation points.
template <class Term, class... States>
auto evaluate(const Term& term, const States&... states) {
  struct Evaluated {
    Eigen::Matrix<double, Term::kResiduals, 1> r;
    typename Term::Jacobians J;
  } out;
  if ((states.frozen || ...)) {
    term.evaluate(linearization_point(states)..., out.r, &out.J);
    term.evaluate(states.now..., out.r, nullptr);
  } else {
    term.evaluate(states.now..., out.r, &out.J);
  }
  return out;
}

// All factors but the marginal prior. Where they go (the sink) chooses which are taken, and gives
// the root of each robust weight.
template <class Sink>
void add_pose_factors(State& state, double bound, Sink& sink) {
  const auto pose = [&](int a) -> const Pose& { return state.poses[static_cast<std::size_t>(a)]; };
  for (auto& f : state.relative_poses) {
    const int a = state.find(f.from), b = state.find(f.to);
    if (!sink.takes_pose(a) && !sink.takes_pose(b)) continue;
    const auto e = evaluate(f.term, pose(a), pose(b));
    const double chi = e.r.squaredNorm();
    const double root = sink.root_weight(f.weight, chi, f.robust ? robust_weight(chi, bound) : 1.0);
    sink.add_pose_pose(a, b, root * std::get<0>(e.J), root * std::get<1>(e.J), root * e.r);
  }
  for (const auto& f : state.pose_priors) {
    const int a = state.find(f.id);
    if (!sink.takes_pose(a)) continue;
    const auto e = evaluate(f.term, pose(a));
    sink.add_pose(a, std::get<0>(e.J), e.r);
  }
  for (const auto& f : state.gravity) {
    const int a = state.find(f.id);
    if (!sink.takes_pose(a)) continue;
    const auto e = evaluate(f.term, pose(a));
    sink.add_pose(a, std::get<0>(e.J), e.r);
  }
}

template <class Sink>
void add_plane_factors(State& state, double bound, Sink& sink) {
  for (const auto& f : state.plane_priors) {
    const int a = state.find(f.id);
    if (!sink.takes_plane(a)) continue;
    sink.add_plane(a, f.S, f.S * state.planes[static_cast<std::size_t>(a)].now.minus(f.at));
  }
  const auto position = positions(state.planes);
  int a = -1;
  for (auto& view : state.views) {
    if (a < 0 || state.poses[static_cast<std::size_t>(a)].id != view.keyframe) {
      a = state.find(view.keyframe);
    }
    const int b = position(view.plane);
    if (!sink.takes_pose(a) && !sink.takes_plane(b)) continue;
    const Pose& pose = state.poses[static_cast<std::size_t>(a)];
    const Landmark& plane = state.planes[static_cast<std::size_t>(b)];
    const auto e = evaluate(view.term, pose, plane);
    const double chi = e.r.squaredNorm();
    const double root = sink.root_weight(view.weight, chi, robust_weight(chi, bound));
    sink.add_pose_plane(a, b, root * std::get<0>(e.J), root * std::get<1>(e.J), root * e.r);
  }
}

struct Equations {
  WindowSystem& system;
  Build what;
  double &cost, &weight_change;

  bool takes_pose(int /*pose*/) const { return true; }
  bool takes_plane(int /*plane*/) const { return true; }
  // Of a factor's robust weight in the equations, given that of the present states.
  double root_weight(double& stored, double chi, double weight) {
    cost += huber(chi, weight);
    if (what == Build::kEquations) stored = weight;
    weight_change = std::max(weight_change, std::abs(weight - stored));
    return std::sqrt(what == Build::kFirst ? stored : weight);
  }
  void add_pose_pose(int a, int b, const Matrix6d& Ja, const Matrix6d& Jb, const Vector6d& r) {
    if (a < b) {
      system.add_pose_pose(a, b, Ja, Jb, r);
    } else {
      system.add_pose_pose(b, a, Jb, Ja, r);
    }
  }
  template <class Jacobian, class Residual>
  void add_pose(int pose, const Jacobian& J, const Residual& r) {
    cost += r.squaredNorm();
    system.add_pose(pose, J, r);
  }
  void add_plane(int plane, const Eigen::Matrix3d& J, const Eigen::Vector3d& r) {
    cost += r.squaredNorm();
    system.add_plane(plane, J, r);
  }
  void add_pose_plane(int pose, int plane, const Eigen::Matrix<double, 4, 6>& J_pose,
                      const Eigen::Matrix<double, 4, 3>& J_plane, const Eigen::Vector4d& r) {
    system.add_pose_plane(pose, plane, J_pose, J_plane, r);
  }
};

std::vector<int> prior_columns(const State& state) {
  std::vector<int> columns;
  const int border = 6 * static_cast<int>(state.poses.size());
  for (const KeyframeId id : state.prior.poses) {
    for (int k = 0; k < 6; ++k) columns.push_back(6 * state.find(id) + k);
  }
  for (const PlaneId id : state.prior.planes) {
    for (int k = 0; k < 3; ++k) columns.push_back(border + 3 * state.find(id) + k);
  }
  return columns;
}

// Factors of states that go, each by itself; planes are numbered after all poses.
struct Touching {
  const std::vector<bool>&pose_gone, &plane_gone;
  std::vector<LinearFactor>& factors;

  bool takes_pose(int pose) const { return pose_gone[static_cast<std::size_t>(pose)]; }
  bool takes_plane(int plane) const { return plane_gone[static_cast<std::size_t>(plane)]; }
  double root_weight(double /*stored*/, double /*chi*/, double weight) const {
    return std::sqrt(weight);
  }
  int variable(int plane) const { return static_cast<int>(pose_gone.size()) + plane; }
  void add_pose_pose(int a, int b, const Matrix6d& Ja, const Matrix6d& Jb, const Vector6d& r) {
    factors.push_back({{a, b}, {Ja, Jb}, r});
  }
  void add_pose(int pose, const Eigen::MatrixXd& J, const Eigen::VectorXd& r) {
    factors.push_back({{pose}, {J}, r});
  }
  void add_plane(int plane, const Eigen::Matrix3d& J, const Eigen::Vector3d& r) {
    factors.push_back({{variable(plane)}, {J}, r});
  }
  void add_pose_plane(int pose, int plane, const Eigen::Matrix<double, 4, 6>& J_pose,
                      const Eigen::Matrix<double, 4, 3>& J_plane, const Eigen::Vector4d& r) {
    factors.push_back({{pose, variable(plane)}, {J_pose, J_plane}, r});
  }
};

}  // namespace

BuiltEquations build_equations(State& state, double robust_chi_squared, Build what,
                               WindowSystem& system) {
  if (what == Build::kGradient) {
    system.reset_gradient();
  } else {
    system.reset(static_cast<int>(state.poses.size()), static_cast<int>(state.planes.size()));
  }
  BuiltEquations built;
  const Prior& prior = state.prior;
  if (prior.r.size() > 0) {
    const Eigen::VectorXd e = prior.r + prior.R * state.prior_step();
    built.cost += e.squaredNorm();
    system.add_dense(prior_columns(state), prior.H, prior.R.transpose() * e);
  }
  Equations equations{system, what, built.cost, built.weight_change};
  add_pose_factors(state, robust_chi_squared, equations);
  add_plane_factors(state, robust_chi_squared, equations);
  return built;
}

std::vector<LinearFactor> linearize_touching(State& state, double robust_chi_squared,
                                             const std::vector<bool>& pose_gone,
                                             const std::vector<bool>& plane_gone) {
  std::vector<LinearFactor> factors;
  const Prior& prior = state.prior;
  if (prior.r.size() > 0) {
    LinearFactor f;
    Eigen::Index column = 0;
    for (const KeyframeId id : prior.poses) {
      f.variables.push_back(state.find(id));
      f.jacobians.push_back(prior.R.middleCols(column, 6));
      column += 6;
    }
    for (const PlaneId id : prior.planes) {
      f.variables.push_back(static_cast<int>(state.poses.size()) + state.find(id));
      f.jacobians.push_back(prior.R.middleCols(column, 3));
      column += 3;
    }
    f.residual = prior.r + prior.R * state.prior_step();
    factors.push_back(std::move(f));
  }
  Touching touching{pose_gone, plane_gone, factors};
  add_pose_factors(state, robust_chi_squared, touching);
  add_plane_factors(state, robust_chi_squared, touching);
  return factors;
}

}  // namespace lamina::window
