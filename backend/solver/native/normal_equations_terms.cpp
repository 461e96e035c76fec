// The graph taken apart into states and terms, and the terms scattered into the matrix.
#include <lamina/backend/graph/turns.hpp>
#include <lamina/backend/solver/native/normal_equations_impl.hpp>

namespace lamina {

using namespace detail;

NormalEquations::Impl::Impl(const Graph& graph, Parts parts) {
  states.turns_only = parts == Parts::kTurns;
  make_states(graph);
  make_pose_terms(graph);
  make_plane_terms(graph);
  if (!states.turns_only) make_surfel_terms(graph);
  make_marginals(graph);
  make_custom(graph);
  std::vector<std::pair<int, int>> pairs;
  each_group([&](FactorType, auto& group, const auto&) { group.pairs(states, pairs); });
  const auto add_pairs = [&pairs](const std::vector<int>& v) {
    for (std::size_t a = 0; a < v.size(); ++a) {
      for (std::size_t b = a + 1; b < v.size(); ++b) {
        if (v[a] != kHeld && v[b] != kHeld && v[a] != v[b]) pairs.emplace_back(v[a], v[b]);
      }
    }
  };
  for (const Marginal& marginal : marginals) add_pairs(variables(marginal));
  for (const Custom& custom : customs) add_pairs(variables(custom));
  matrix = std::make_unique<BlockCholesky>(sizes, std::move(pairs));
  each_group([&](FactorType, auto& group, const auto&) { group.find_slots(states, *matrix); });
  gradient.setZero(matrix->dimension());
  graph_anchors = anchors_before = anchors;
}

void NormalEquations::Impl::make_states(const Graph& graph) {
  const auto add = [this]<class State>(States<State>& kind, const State& state, bool held) {
    kind.now.push_back(state);
    kind.variable.push_back(held ? kHeld : static_cast<int>(sizes.size()));
    if (held) return;
    sizes.push_back(states.turns_only ? TurningColumns<State>::kCount : State::kTangent);
  };
  states.poses.now.reserve(graph.keyframes.size());
  for (const Keyframe& k : graph.keyframes) {
    add(states.poses, PoseState(k.T_map_body), k.fixed);
  }
  for (const PlaneLandmark& p : graph.planes) {
    add(states.planes, PlaneState(p.plane_anchor), p.fixed || !p.active);
    anchors.push_back(p.anchor_map);
    anchor_is_fixed.push_back(p.fixed || !p.active);
  }
  for (const SurfelLandmark& s : graph.surfels) {
    add(states.surfels, FlatState(s.state), states.turns_only);
  }
  for (const Extrinsics& e : graph.extrinsics) {
    add(states.extrinsics, PoseState(e.state), !e.estimate || states.turns_only);
  }
}

namespace {
template <class StateVector, class State>
int index_in(const StateVector& states, const State& state) {
  return static_cast<int>(&state - states.data());
}
}  // namespace

void NormalEquations::Impl::make_pose_terms(const Graph& graph) {
  const auto pose = [&](KeyframeId id) { return index_in(graph.keyframes, graph.at(id)); };
  const auto observed = [this](auto factor, int positions) {
    return states.turns_only ? without_positions(std::move(factor), positions) : factor;
  };
  // `whole`: of the body where no sensor moves, `of_sensor`: else. True for the former.
  const auto add = [&](const auto& f, auto& whole, auto& of_sensor) {
    const Extrinsics* sensor = moving_sensor(graph, f.extrinsics);
    if (sensor == nullptr) {
      whole.add(OdometryTerm(observed(f, 3)), {pose(f.from), pose(f.to)});
    } else {
      of_sensor.add(OdometryOfSensorTerm(observed(f, 3), *sensor),
                    {pose(f.from), pose(f.to), index_in(graph.extrinsics, *sensor)});
    }
    return sensor == nullptr;
  };
  for (const auto& f : graph.odometry) add(f, odometry, odometry_of_sensor);
  for (const auto& f : graph.planar_odometry) {
    planar.add(PlanarOdometryTerm(observed(f, 2)), {pose(f.from), pose(f.to)});
  }
  loop_count = graph.loops.size();
  for (std::size_t i = 0; i < loop_count; ++i) {
    const LoopFactor& f = graph.loops[i];
    if (!(f.weight > 0)) continue;
    const bool whole = add(f, loops, loops_of_sensor);
    (whole ? loop_factor : loop_of_sensor_factor).push_back(i);
    (whole ? loop_weights : loop_of_sensor_weights).push_back(f.weight);
  }
  for (const auto& f : graph.priors) priors.add(PriorTerm(observed(f, 3)), {pose(f.keyframe)});
  for (const auto& f : graph.gravity) gravity.add(GravityTerm(f), {pose(f.keyframe)});
  for (const auto& e : graph.extrinsics) {
    if (e.estimate) {
      extrinsics_priors.add(PriorTerm(e), {index_in(graph.extrinsics, e)});
    }
  }
}

void NormalEquations::Impl::make_plane_terms(const Graph& graph) {
  const auto observed = [this](const Moments& m) {
    return states.turns_only ? without_positions(m) : m;
  };
  moments_count = graph.plane_moments.size();
  for (std::size_t i = 0; i < moments_count; ++i) {
    const PlaneMomentsFactor& f = graph.plane_moments[i];
    if (!(f.weight > 0)) continue;
    const PlaneLandmark& plane = graph.at(f.plane);
    const int k = index_in(graph.keyframes, graph.at(f.keyframe));
    const int p = index_in(graph.planes, plane);
    for_each_part(graph, f, [&](const Moments& part, const Extrinsics* sensor) {
      if (sensor == nullptr) {
        moments.add(PlaneMomentsTerm(observed(part), plane.anchor_map), {k, p});
        moments_factor.push_back(i);
        moments_weights.push_back(f.weight);
        return;
      }
      moments_of_sensor.add(PlaneMomentsOfSensorTerm(observed(part), plane.anchor_map, *sensor),
                            {k, p, index_in(graph.extrinsics, *sensor)});
      moments_of_sensor_factor.push_back(i);
      moments_of_sensor_weights.push_back(f.weight);
    });
  }
  segment_count = graph.segments.size();
  for (std::size_t i = 0; i < segment_count; ++i) {
    SegmentFactor f = graph.segments[i];
    if (!(f.weight > 0)) continue;
    if (states.turns_only) f.sqrt_information.col(1).setZero();
    const PlaneLandmark& plane = graph.at(f.plane);
    segments.add(SegmentTerm(f, plane.anchor_map),
                 {index_in(graph.keyframes, graph.at(f.keyframe)), index_in(graph.planes, plane)});
    segment_factor.push_back(i);
    segment_weights.push_back(f.weight);
  }
}

void NormalEquations::Impl::make_surfel_terms(const Graph& graph) {
  for (const auto& f : graph.surfel_moments) {
    const SurfelLandmark& surfel = graph.at(f.surfel);
    const int s = index_in(graph.surfels, surfel);
    if (f.keyframe == surfel.anchor) {
      surfels_own.add(SurfelMomentsOwnTerm(f.moments_body, surfel.T_body_cell), {s});
      continue;
    }
    surfels.add(SurfelMomentsTerm(f.moments_body, surfel.T_body_cell),
                {index_in(graph.keyframes, graph.at(f.keyframe)),
                 index_in(graph.keyframes, graph.at(surfel.anchor)), s});
  }
  for (const auto& f : graph.surfel_parents) {
    const SurfelLandmark& surfel = graph.at(f.surfel);
    const PlaneLandmark& plane = graph.at(f.plane);
    parents.add(SurfelParentTerm(f, surfel.T_body_cell, plane.anchor_map),
                {index_in(graph.keyframes, graph.at(surfel.anchor)), index_in(graph.planes, plane),
                 index_in(graph.surfels, surfel)});
  }
}

void NormalEquations::Impl::make_marginals(const Graph& graph) {
  for (const MarginalPrior& prior : graph.marginal_priors) {
    Marginal marginal{prior, {}, {}, {}};
    for (const auto id : prior.keyframes) {
      marginal.poses.push_back(index_in(graph.keyframes, graph.at(id)));
    }
    for (const auto id : prior.planes) {
      marginal.planes.push_back(index_in(graph.planes, graph.at(id)));
    }
    for (const auto id : prior.surfels) {
      marginal.surfels.push_back(index_in(graph.surfels, graph.at(id)));
    }
    for (const int p : marginal.planes) {
      if (!marginal.own()) anchor_is_fixed[static_cast<std::size_t>(p)] = true;
    }
    marginals.push_back(std::move(marginal));
  }
}

void NormalEquations::Impl::tell_anchors() {
  const auto anchor = [this](int plane) { return anchors[static_cast<std::size_t>(plane)]; };
  moments.each([&](auto& term, const auto& index) { term.anchor_map = anchor(index[1]); });
  moments_of_sensor.each(
      [&](auto& term, const auto& index) { term.of_sensor.anchor_map = anchor(index[1]); });
  segments.each([&](auto& term, const auto& index) { term.anchor_map = anchor(index[1]); });
  parents.each([&](auto& term, const auto& index) { term.anchor_map = anchor(index[1]); });
}

std::vector<Eigen::Vector4d> NormalEquations::Impl::evidence_middles() {
  std::vector<Eigen::Vector4d> sums(anchors.size(), Eigen::Vector4d::Zero());
  const auto collect = [&](const PoseState& T, int plane, const Eigen::Vector3d& mean_body) {
    const auto p = static_cast<std::size_t>(plane);
    sums[p].head<3>() += T.R * mean_body + (T.t - anchors[p]);
    sums[p](3) += 1;
  };
  const auto pose = [this](int i) -> const PoseState& { return states.poses.now[std::size_t(i)]; };
  moments.each([&](auto& term, const auto& i) { collect(pose(i[0]), i[1], term.mean_body); });
  moments_of_sensor.each([&](auto& term, const auto& i) {
    const PoseState& sensor = states.extrinsics.now[std::size_t(i[2])];
    collect(pose(i[0]) * sensor, i[1], term.of_sensor.mean_body);
  });
  segments.each([&](auto& term, const auto& i) { collect(pose(i[0]), i[1], term.middle_body); });
  for (Eigen::Vector4d& sum : sums) {
    if (sum(3) > 0) sum.head<3>() /= sum(3);
  }
  return sums;
}

void NormalEquations::Impl::reanchor() {
  constexpr double kFarSquared = 0.25;  // m^2: nearer than this, moving gains nothing
  middles = evidence_middles();
  bool moved = false;
  for (std::size_t p = 0; p < anchors.size(); ++p) {
    if (anchor_is_fixed[p] || middles[p](3) == 0) continue;
    PlaneState& plane = states.planes.now[p];
    const Eigen::Vector3d middle = middles[p].head<3>();
    const Eigen::Vector3d shift = middle - (plane.n.dot(middle) - plane.rho) * plane.n;
    if (!(shift.squaredNorm() > kFarSquared) || !shift.allFinite()) continue;
    anchors[p] += shift;
    middles[p].head<3>() -= shift;
    plane.rho -= plane.n.dot(shift);
    moved = true;
  }
  if (moved) tell_anchors();
}

void NormalEquations::Impl::carry_anchors(const std::vector<Eigen::Vector3d>& normals) {
  const std::vector<Eigen::Vector4d> after = evidence_middles();
  for (std::size_t p = 0; p < anchors.size(); ++p) {
    if (anchor_is_fixed[p] || after[p](3) == 0) continue;
    const Eigen::Vector3d& n = normals[p];
    const Eigen::Vector3d shift = (after[p] - middles[p]).head<3>();
    if (shift.allFinite()) anchors[p] += shift - n.dot(shift) * n;
  }
  tell_anchors();
}

std::vector<int> NormalEquations::Impl::variables(const Marginal& marginal) const {
  std::vector<int> v;
  for (const int i : marginal.poses) v.push_back(states.poses.variable[std::size_t(i)]);
  for (const int i : marginal.planes) v.push_back(states.planes.variable[std::size_t(i)]);
  for (const int i : marginal.surfels) v.push_back(states.surfels.variable[std::size_t(i)]);
  return v;
}

Eigen::MatrixXd NormalEquations::Impl::turning_columns(const Eigen::MatrixXd& J,
                                                       const Marginal& marginal) {
  std::vector<Eigen::Index> kept;
  Eigen::Index column = 0;
  const auto keep = [&](int first, int count, int size) {
    for (int k = 0; k < count; ++k) kept.push_back(column + first + k);
    column += size;
  };
  using Pose = TurningColumns<PoseState>;
  using Other = TurningColumns<PlaneState>;
  for (std::size_t i = 0; i < marginal.poses.size(); ++i) keep(Pose::kFirst, Pose::kCount, 6);
  while (column < J.cols()) keep(Other::kFirst, Other::kCount, 3);
  return J(Eigen::all, kept);
}

void NormalEquations::Impl::add_block_terms(const std::vector<int>& v, std::size_t poses,
                                            const Eigen::MatrixXd& J, const Eigen::VectorXd& r,
                                            Eigen::VectorXd& out) const {
  const Eigen::Index pose_size = states.turns_only ? TurningColumns<PoseState>::kCount : 6;
  const Eigen::Index other_size = states.turns_only ? TurningColumns<PlaneState>::kCount : 3;
  const Eigen::MatrixXd H = J.transpose() * J;
  const Eigen::VectorXd g = J.transpose() * r;
  Eigen::Index row = 0;
  for (std::size_t a = 0; a < v.size(); ++a) {
    const Eigen::Index rows = a < poses ? pose_size : other_size;
    Eigen::Index column = row;
    if (v[a] != kHeld) out.segment(matrix->row_of(v[a]), rows) += g.segment(row, rows);
    for (std::size_t b = a; b < v.size(); ++b) {
      const Eigen::Index columns = b < poses ? pose_size : other_size;
      if (v[a] != kHeld && v[b] != kHeld) {
        matrix->slot(v[a], v[b]).add_block(H.block(row, column, rows, columns));
      }
      column += columns;
    }
    row += rows;
  }
}

double NormalEquations::Impl::evaluate(const Marginal& marginal, Eigen::VectorXd* out) const {
  std::vector<PoseState> poses;
  std::vector<PlaneState> planes;
  std::vector<FlatState> surfel_states;
  for (const int i : marginal.poses) poses.push_back(states.poses.now[std::size_t(i)]);
  for (const int i : marginal.planes) {
    // The prior knows the graph's anchor: n.(x - anchor) = rho there is rho + n.shift here.
    planes.push_back(states.planes.now[std::size_t(i)]);
    planes.back().rho +=
        planes.back().n.dot(anchors[std::size_t(i)] - graph_anchors[std::size_t(i)]);
  }
  for (const int i : marginal.surfels) surfel_states.push_back(states.surfels.now[std::size_t(i)]);
  Eigen::VectorXd r;
  Eigen::MatrixXd J;
  evaluate_marginal_prior(marginal.prior, poses, planes, surfel_states, r,
                          out != nullptr ? &J : nullptr);
  if (out == nullptr) return r.squaredNorm();
  if (marginal.own()) {
    const auto p = std::size_t(marginal.planes.front());
    J.leftCols<2>() +=
        J.col(2) * ((anchors[p] - graph_anchors[p]).transpose() * states.planes.now[p].B);
  }
  if (states.turns_only) J = turning_columns(J, marginal);
  add_block_terms(variables(marginal), poses.size(), J, r, *out);
  return r.squaredNorm();
}

CostByType NormalEquations::Impl::evaluate(Eigen::VectorXd* out) const {
  CostByType cost{};
  const_cast<Impl*>(this)->each_group(
      [&](FactorType type, const auto& group, const std::vector<double>& weights) {
        cost[static_cast<std::size_t>(type)] += group.evaluate(states, weights, out);
      });
  for (const Marginal& marginal : marginals) {
    cost[static_cast<std::size_t>(FactorType::kMarginalPrior)] += evaluate(marginal, out);
  }
  for (const Custom& custom : customs) {
    cost[static_cast<std::size_t>(FactorType::kCustom)] += evaluate(custom, out);
  }
  return cost;
}

}  // namespace lamina
