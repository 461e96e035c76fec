// The window's factors at their linearisation point: into the equations of a solve, or one by one
// for an elimination.
#include <lamina/backend/solver/window/window_equations.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <lamina/backend/solver/ceres/lift.hpp>
#include <lamina/backend/solver/window/surfel_elimination.hpp>

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

struct EvaluatedCustom {
  std::vector<int> poses;
  std::vector<Eigen::MatrixXd> J;  ///< to tangents, at the linearisation points
  Eigen::VectorXd r;               ///< at the present states; both times the root of the weight
  double cost = 0;
};

EvaluatedCustom evaluate(const Custom& f, const State& state) {
  EvaluatedCustom out;
  std::vector<std::array<double, PoseState::kAmbient>> now(f.keyframes.size()), first = now;
  std::vector<const double*> at_now, at_first;
  for (std::size_t k = 0; k < f.keyframes.size(); ++k) {
    out.poses.push_back(state.find(f.keyframes[k]));
    const Pose& pose = state.poses[static_cast<std::size_t>(out.poses[k])];
    pose.now.write(now[k].data());
    linearization_point(pose).write(first[k].data());
    at_now.push_back(now[k].data());
    at_first.push_back(first[k].data());
  }
  CustomEvaluation present, linear;
  if (!lamina::evaluate(f.factor, at_now, false, present) ||
      !lamina::evaluate(f.factor, at_first, true, linear)) {
    out.cost = std::numeric_limits<double>::infinity();
    return out;
  }
  const double root = std::sqrt(f.factor.weight * std::max(0.0, present.slope));
  for (std::size_t k = 0; k < f.keyframes.size(); ++k) {
    const Pose& pose = state.poses[static_cast<std::size_t>(out.poses[k])];
    out.J.push_back(root * to_tangent(linearization_point(pose), at_first[k], linear.J[k]));
  }
  out.r = root * present.r;
  out.cost = f.factor.weight * present.robust;
  return out;
}

template <class Sink>
void add_custom_factors(const State& state, Sink& sink) {
  for (const Custom& f : state.custom) {
    const bool taken = std::any_of(f.keyframes.begin(), f.keyframes.end(),
                                   [&](KeyframeId id) { return sink.takes_pose(state.find(id)); });
    if (taken) sink.add_custom(evaluate(f, state));
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
  void add_custom(const EvaluatedCustom& f) {
    cost += f.cost;
    if (f.J.empty()) return;
    std::vector<int> columns;
    Eigen::MatrixXd J(f.r.size(), static_cast<Eigen::Index>(6 * f.poses.size()));
    for (std::size_t k = 0; k < f.poses.size(); ++k) {
      J.middleCols<6>(static_cast<Eigen::Index>(6 * k)) = f.J[k];
      for (int i = 0; i < 6; ++i) columns.push_back(6 * f.poses[k] + i);
    }
    system.add_dense(columns, J.transpose() * J, J.transpose() * f.r);
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
  void add_custom(const EvaluatedCustom& f) {
    if (!f.J.empty()) factors.push_back({f.poses, f.J, f.r});
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
  add_custom_factors(state, equations);
  if (!state.surfels.empty()) {
    const SurfelInformation surfels = eliminate_surfels(
        state, [](const Surfel&) { return true; }, what == Build::kGradient);
    built.cost += surfels.cost;
    system.add_dense(surfels.columns, surfels.H, surfels.g);
  }
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
  add_custom_factors(state, touching);
  if (!state.surfels.empty()) {
    const SurfelInformation surfels = eliminate_surfels(
        state, [&](const Surfel& s) { return state.goes(s, pose_gone, plane_gone); }, false);
    LinearFactor factor = surfel_factor(surfels, state);
    if (!factor.variables.empty()) factors.push_back(std::move(factor));
  }
  return factors;
}

}  // namespace lamina::window
