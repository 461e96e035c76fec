// Terms in groups of one type each, scattered into the block Cholesky's matrix.
#include <lamina/backend/normal_equations.hpp>

#include <lamina/backend/factors/gravity.hpp>
#include <lamina/backend/factors/marginal_prior.hpp>
#include <lamina/backend/factors/odometry.hpp>
#include <lamina/backend/factors/plane_moments.hpp>
#include <lamina/backend/factors/prior.hpp>
#include <lamina/backend/factors/segment.hpp>
#include <lamina/backend/factors/surfel_moments.hpp>
#include <lamina/backend/term_group.hpp>

namespace lamina {

using namespace detail;

struct NormalEquations::Impl {
  AllStates states;
  std::vector<int> sizes;  ///< of variables
  Group<Kernel::kNone, OdometryTerm, PoseKind, PoseKind> odometry, loops;
  Group<Kernel::kNone, PlanarOdometryTerm, PoseKind, PoseKind> planar;
  Group<Kernel::kNone, PriorTerm, PoseKind> priors;
  Group<Kernel::kNone, GravityTerm, PoseKind> gravity;
  Group<Kernel::kNone, ExtrinsicsPriorTerm, ExtrinsicsKind> extrinsics_priors;
  Group<Kernel::kNone, PlaneMomentsTerm, PoseKind, PlaneKind> moments;
  Group<Kernel::kNone, PlaneMomentsExtrinsicsTerm, PoseKind, PlaneKind, ExtrinsicsKind>
      moments_extrinsics;
  Group<Kernel::kNone, SegmentTerm, PoseKind, PlaneKind> segments;
  Group<Kernel::kNone, SurfelMomentsOwnTerm, SurfelKind> surfels_own;
  Group<Kernel::kNone, SurfelMomentsTerm, PoseKind, PoseKind, SurfelKind> surfels;
  Group<Kernel::kCauchyParent, SurfelParentTerm, PoseKind, PlaneKind, SurfelKind> parents;

  struct Marginal {
    MarginalPrior prior;
    std::vector<int> poses, planes, surfels;  ///< indices of states
  };
  std::vector<Marginal> marginals;
  // Which factor of the graph a doubtful term is.
  std::vector<std::size_t> loop_factor, moments_factor, moments_extrinsics_factor, segment_factor;
  std::size_t loop_count = 0, moments_count = 0, segment_count = 0;  ///< in the graph
  std::vector<double> loop_weights, moments_weights, moments_extrinsics_weights, segment_weights;
  std::unique_ptr<BlockCholesky> matrix;
  Eigen::VectorXd gradient;
  // Where planes' distances are taken while solving: the middle of their evidence, and carried
  // along the plane by a step that moves the evidence. The linear system is the same for any such
  // point; what changes is the second order: a plane that turns about a point its evidence moved
  // away from would miss it by tilt times shift, and Newton would crawl along a curved valley.
  std::vector<Eigen::Vector3d> anchors, anchors_before, graph_anchors;
  std::vector<Eigen::Vector4d> middles;
  std::vector<bool> anchor_is_fixed;  ///< a marginal prior speaks of it

  explicit Impl(const Graph& graph);
  void make_states(const Graph& graph);
  void make_pose_terms(const Graph& graph);
  void make_plane_terms(const Graph& graph);
  void make_surfel_terms(const Graph& graph);
  void make_marginals(const Graph& graph);
  /// Mean of the evidence's means from each anchor (3), and how many they are.
  std::vector<Eigen::Vector4d> evidence_middles();
  void reanchor();
  void carry_anchors();
  void tell_anchors();
  template <class F>
  void each_group(F&& f);
  template <class F>
  void each_kind(F&& f);
  CostByType evaluate(Eigen::VectorXd* out) const;
  double evaluate(const Marginal& marginal, Eigen::VectorXd* out) const;
  std::vector<int> variables(const Marginal& marginal) const;
};

NormalEquations::Impl::Impl(const Graph& graph) {
  make_states(graph);
  make_pose_terms(graph);
  make_plane_terms(graph);
  make_surfel_terms(graph);
  make_marginals(graph);
  std::vector<std::pair<int, int>> pairs;
  each_group([&](FactorType, auto& group, const auto&) { group.pairs(states, pairs); });
  for (const Marginal& marginal : marginals) {
    const std::vector<int> v = variables(marginal);
    for (std::size_t a = 0; a < v.size(); ++a) {
      for (std::size_t b = a + 1; b < v.size(); ++b) {
        if (v[a] != kHeld && v[b] != kHeld && v[a] != v[b]) pairs.emplace_back(v[a], v[b]);
      }
    }
  }
  matrix = std::make_unique<BlockCholesky>(sizes, std::move(pairs));
  each_group([&](FactorType, auto& group, const auto&) { group.find_slots(states, *matrix); });
  gradient.setZero(matrix->dimension());
  graph_anchors = anchors_before = anchors;
}

template <class F>
void NormalEquations::Impl::each_group(F&& f) {
  static const std::vector<double> kOnes;
  f(FactorType::kOdometry, odometry, kOnes);
  f(FactorType::kPlanarOdometry, planar, kOnes);
  f(FactorType::kLoop, loops, loop_weights);
  f(FactorType::kPrior, priors, kOnes);
  f(FactorType::kPrior, extrinsics_priors, kOnes);
  f(FactorType::kGravity, gravity, kOnes);
  f(FactorType::kPlaneMoments, moments, moments_weights);
  f(FactorType::kPlaneMoments, moments_extrinsics, moments_extrinsics_weights);
  f(FactorType::kSegment, segments, segment_weights);
  f(FactorType::kSurfelMoments, surfels_own, kOnes);
  f(FactorType::kSurfelMoments, surfels, kOnes);
  f(FactorType::kSurfelParent, parents, kOnes);
}

template <class F>
void NormalEquations::Impl::each_kind(F&& f) {
  f(states.poses);
  f(states.planes);
  f(states.surfels);
  f(states.extrinsics);
}

void NormalEquations::Impl::make_states(const Graph& graph) {
  const auto add = [this](auto& kind, auto state, bool held, int size) {
    kind.now.push_back(state);
    kind.variable.push_back(held ? kHeld : static_cast<int>(sizes.size()));
    if (!held) sizes.push_back(size);
  };
  states.poses.now.reserve(graph.keyframes.size());
  for (const Keyframe& k : graph.keyframes) {
    add(states.poses, PoseState(k.T_map_body), k.fixed, PoseState::kTangent);
  }
  for (const PlaneLandmark& p : graph.planes) {
    add(states.planes, PlaneState(p.plane_anchor), p.fixed || !p.active, PlaneState::kTangent);
    anchors.push_back(p.anchor_map);
    anchor_is_fixed.push_back(p.fixed || !p.active);
  }
  for (const SurfelLandmark& s : graph.surfels) {
    add(states.surfels, FlatState(s.state), false, FlatState::kTangent);
  }
  for (const Extrinsics& e : graph.extrinsics) {
    add(states.extrinsics, FlatState(e.state), !e.estimate, FlatState::kTangent);
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
  for (const auto& f : graph.odometry) odometry.add(OdometryTerm(f), {pose(f.from), pose(f.to)});
  for (const auto& f : graph.planar_odometry) {
    planar.add(PlanarOdometryTerm(f), {pose(f.from), pose(f.to)});
  }
  loop_count = graph.loops.size();
  for (std::size_t i = 0; i < loop_count; ++i) {
    const LoopFactor& f = graph.loops[i];
    if (!(f.weight > 0)) continue;
    loops.add(OdometryTerm(f), {pose(f.from), pose(f.to)});
    loop_factor.push_back(i);
    loop_weights.push_back(f.weight);
  }
  for (const auto& f : graph.priors) priors.add(PriorTerm(f), {pose(f.keyframe)});
  for (const auto& f : graph.gravity) gravity.add(GravityTerm(f), {pose(f.keyframe)});
  for (const auto& e : graph.extrinsics) {
    if (e.estimate) {
      extrinsics_priors.add(ExtrinsicsPriorTerm(e), {index_in(graph.extrinsics, e)});
    }
  }
}

void NormalEquations::Impl::make_plane_terms(const Graph& graph) {
  moments_count = graph.plane_moments.size();
  for (std::size_t i = 0; i < moments_count; ++i) {
    const PlaneMomentsFactor& f = graph.plane_moments[i];
    if (!(f.weight > 0)) continue;
    const PlaneLandmark& plane = graph.at(f.plane);
    const int k = index_in(graph.keyframes, graph.at(f.keyframe));
    const int p = index_in(graph.planes, plane);
    if (f.extrinsics == ExtrinsicsId::kNone) {
      moments.add(PlaneMomentsTerm(f.moments_body, plane.anchor_map), {k, p});
      moments_factor.push_back(i);
      moments_weights.push_back(f.weight);
      continue;
    }
    const Extrinsics& sensor = graph.at(f.extrinsics);
    moments_extrinsics.add(PlaneMomentsExtrinsicsTerm(f.moments_body, plane.anchor_map,
                                                      sensor.T_body_sensor.translation()),
                           {k, p, index_in(graph.extrinsics, sensor)});
    moments_extrinsics_factor.push_back(i);
    moments_extrinsics_weights.push_back(f.weight);
  }
  segment_count = graph.segments.size();
  for (std::size_t i = 0; i < segment_count; ++i) {
    const SegmentFactor& f = graph.segments[i];
    if (!(f.weight > 0)) continue;
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
      anchor_is_fixed[static_cast<std::size_t>(marginal.planes.back())] = true;
    }
    for (const auto id : prior.surfels) {
      marginal.surfels.push_back(index_in(graph.surfels, graph.at(id)));
    }
    marginals.push_back(std::move(marginal));
  }
}

void NormalEquations::Impl::tell_anchors() {
  const auto anchor = [this](int plane) { return anchors[static_cast<std::size_t>(plane)]; };
  moments.each([&](auto& term, const auto& index) { term.anchor_map = anchor(index[1]); });
  moments_extrinsics.each(
      [&](auto& term, const auto& index) { term.nominal.anchor_map = anchor(index[1]); });
  segments.each([&](auto& term, const auto& index) { term.anchor_map = anchor(index[1]); });
  parents.each([&](auto& term, const auto& index) { term.anchor_map = anchor(index[1]); });
}

std::vector<Eigen::Vector4d> NormalEquations::Impl::evidence_middles() {
  std::vector<Eigen::Vector4d> sums(anchors.size(), Eigen::Vector4d::Zero());
  const auto collect = [&](int pose, int plane, const Eigen::Vector3d& mean_body) {
    const PoseState& T = states.poses.now[static_cast<std::size_t>(pose)];
    const auto p = static_cast<std::size_t>(plane);
    sums[p].head<3>() += T.R * mean_body + (T.t - anchors[p]);
    sums[p](3) += 1;
  };
  moments.each([&](auto& term, const auto& i) { collect(i[0], i[1], term.mean_body); });
  moments_extrinsics.each(
      [&](auto& term, const auto& i) { collect(i[0], i[1], term.nominal.mean_body); });
  segments.each([&](auto& term, const auto& i) { collect(i[0], i[1], term.middle_body); });
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

void NormalEquations::Impl::carry_anchors() {
  const std::vector<Eigen::Vector4d> after = evidence_middles();
  for (std::size_t p = 0; p < anchors.size(); ++p) {
    if (anchor_is_fixed[p] || after[p](3) == 0) continue;
    const Eigen::Vector3d& n = states.planes.before[p].n;
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

double NormalEquations::Impl::evaluate(const Marginal& marginal, Eigen::VectorXd* out) const {
  std::vector<PoseState> poses;
  std::vector<PlaneState> planes;
  std::vector<FlatState> surfel_states;
  for (const int i : marginal.poses) poses.push_back(states.poses.now[std::size_t(i)]);
  for (const int i : marginal.planes) planes.push_back(states.planes.now[std::size_t(i)]);
  for (const int i : marginal.surfels) surfel_states.push_back(states.surfels.now[std::size_t(i)]);
  Eigen::VectorXd r;
  Eigen::MatrixXd J;
  evaluate_marginal_prior(marginal.prior, poses, planes, surfel_states, r,
                          out != nullptr ? &J : nullptr);
  if (out == nullptr) return r.squaredNorm();
  const std::vector<int> v = variables(marginal);
  const Eigen::MatrixXd H = J.transpose() * J;
  const Eigen::VectorXd g = J.transpose() * r;
  Eigen::Index row = 0;
  for (std::size_t a = 0; a < v.size(); ++a) {
    const Eigen::Index rows = a < poses.size() ? 6 : 3;
    Eigen::Index column = row;
    if (v[a] != kHeld) out->segment(matrix->row_of(v[a]), rows) += g.segment(row, rows);
    for (std::size_t b = a; b < v.size(); ++b) {
      const Eigen::Index columns = b < poses.size() ? 6 : 3;
      if (v[a] != kHeld && v[b] != kHeld) {
        matrix->slot(v[a], v[b]).add_block(H.block(row, column, rows, columns));
      }
      column += columns;
    }
    row += rows;
  }
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
  return cost;
}

NormalEquations::NormalEquations(const Graph& graph) : impl_(std::make_unique<Impl>(graph)) {}
NormalEquations::~NormalEquations() = default;

int NormalEquations::dimension() const { return impl_->matrix->dimension(); }

void NormalEquations::set_weights(const RobustWeights& weights) {
  const auto pick = [](const std::vector<double>& all, const std::vector<std::size_t>& factors,
                       std::vector<double>& out) {
    for (std::size_t i = 0; i < factors.size(); ++i) out[i] = all[factors[i]];
  };
  pick(weights.loops, impl_->loop_factor, impl_->loop_weights);
  pick(weights.segments, impl_->segment_factor, impl_->segment_weights);
  pick(weights.plane_moments, impl_->moments_factor, impl_->moments_weights);
  pick(weights.plane_moments, impl_->moments_extrinsics_factor, impl_->moments_extrinsics_weights);
}

CostByType NormalEquations::linearize() {
  impl_->reanchor();
  impl_->matrix->set_zero();
  impl_->gradient.setZero();
  return impl_->evaluate(&impl_->gradient);
}

CostByType NormalEquations::cost() const { return impl_->evaluate(nullptr); }

RobustWeights NormalEquations::chi_squared() const {
  RobustWeights all;
  all.loops.resize(impl_->loop_count);
  all.segments.resize(impl_->segment_count);
  all.plane_moments.resize(impl_->moments_count);
  const auto put = [this](const auto& group, const std::vector<std::size_t>& factors,
                          std::vector<double>& out) {
    std::vector<double> chi2;
    group.chi_squared(impl_->states, chi2);
    for (std::size_t i = 0; i < factors.size(); ++i) out[factors[i]] = chi2[i];
  };
  put(impl_->loops, impl_->loop_factor, all.loops);
  put(impl_->segments, impl_->segment_factor, all.segments);
  put(impl_->moments, impl_->moments_factor, all.plane_moments);
  put(impl_->moments_extrinsics, impl_->moments_extrinsics_factor, all.plane_moments);
  return all;
}

RobustWeights chi_squared_of(const Graph& graph) {
  RobustWeights all;
  const auto pose = [&](KeyframeId id) { return PoseState(graph.at(id).T_map_body); };
  for (const LoopFactor& f : graph.loops) {
    Vector6d r;
    OdometryTerm(f).evaluate(pose(f.from), pose(f.to), r, nullptr);
    all.loops.push_back(r.squaredNorm());
  }
  for (const SegmentFactor& f : graph.segments) {
    const PlaneLandmark& plane = graph.at(f.plane);
    Eigen::Vector2d r;
    SegmentTerm(f, plane.anchor_map)
        .evaluate(pose(f.keyframe), PlaneState(plane.plane_anchor), r, nullptr);
    all.segments.push_back(r.squaredNorm());
  }
  for (const PlaneMomentsFactor& f : graph.plane_moments) {
    const PlaneLandmark& plane = graph.at(f.plane);
    const SE3& T = graph.at(f.keyframe).T_map_body;
    SE3 T_anchor_body(T.so3(), T.translation() - plane.anchor_map);
    if (f.extrinsics != ExtrinsicsId::kNone) {
      T_anchor_body = T_anchor_body * extrinsics_correction(graph.at(f.extrinsics));
    }
    all.plane_moments.push_back(f.moments_body.cost(T_anchor_body.inverse() * plane.plane_anchor));
  }
  return all;
}

const Eigen::VectorXd& NormalEquations::gradient() const { return impl_->gradient; }
Eigen::VectorXd NormalEquations::diagonal() const { return impl_->matrix->diagonal(); }
bool NormalEquations::factorize(const Eigen::VectorXd& added) {
  return impl_->matrix->factorize(added);
}
Eigen::VectorXd NormalEquations::solve(const Eigen::VectorXd& rhs) {
  return impl_->matrix->solve(rhs);
}
int NormalEquations::weak_pivots(double threshold) const {
  return impl_->matrix->weak_pivots(threshold);
}
double NormalEquations::factor_entries() const { return impl_->matrix->factor_entries(); }

void NormalEquations::step(const Eigen::VectorXd& d) {
  impl_->anchors_before = impl_->anchors;
  impl_->each_kind([&](auto& kind) {
    using State = typename std::decay_t<decltype(kind.now)>::value_type;
    kind.before = kind.now;
    for (std::size_t i = 0; i < kind.now.size(); ++i) {
      if (kind.variable[i] == kHeld) continue;
      kind.now[i] = kind.now[i].plus(
          d.template segment<State::kTangent>(impl_->matrix->row_of(kind.variable[i])));
    }
  });
  impl_->carry_anchors();
}

void NormalEquations::undo_step() {
  impl_->each_kind([](auto& kind) { kind.now.swap(kind.before); });
  impl_->anchors.swap(impl_->anchors_before);
  impl_->tell_anchors();
}

void NormalEquations::write(Graph& graph) const {
  const AllStates& s = impl_->states;
  for (std::size_t i = 0; i < graph.keyframes.size(); ++i) {
    if (s.poses.variable[i] != kHeld) graph.keyframes[i].T_map_body = s.poses.now[i].se3();
  }
  for (std::size_t i = 0; i < graph.planes.size(); ++i) {
    if (s.planes.variable[i] == kHeld) continue;
    const Eigen::Vector3d back = impl_->graph_anchors[i] - impl_->anchors[i];
    graph.planes[i].set_plane_anchor(s.planes.now[i].plane().about(back));
  }
  for (std::size_t i = 0; i < graph.surfels.size(); ++i) {
    graph.surfels[i].state = s.surfels.now[i].x;
  }
  for (std::size_t i = 0; i < graph.extrinsics.size(); ++i) {
    graph.extrinsics[i].state = s.extrinsics.now[i].x;
  }
}

namespace {
template <int N, class State>
std::vector<Eigen::Matrix<double, N, N>> blocks_of(BlockCholesky& matrix,
                                                   const std::vector<std::size_t>& indices,
                                                   const States<State>& kind) {
  using Block = Eigen::Matrix<double, N, N>;
  std::vector<int> variables;
  std::vector<std::size_t> place;
  std::vector<Block> result(indices.size(), Block::Zero());
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (kind.variable[indices[i]] == kHeld) continue;
    variables.push_back(kind.variable[indices[i]]);
    place.push_back(i);
  }
  const auto blocks = matrix.inverse_blocks(variables);
  for (std::size_t k = 0; k < blocks.size(); ++k) result[place[k]] = blocks[k];
  return result;
}
}  // namespace

std::vector<Matrix6d> NormalEquations::pose_covariances(const std::vector<std::size_t>& indices) {
  return blocks_of<6>(*impl_->matrix, indices, impl_->states.poses);
}

std::vector<Eigen::Matrix3d> NormalEquations::plane_covariances(
    const std::vector<std::size_t>& indices) {
  auto blocks = blocks_of<3>(*impl_->matrix, indices, impl_->states.planes);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    // About the graph's anchor: rho there is rho here less n.back.
    const std::size_t p = indices[i];
    const Eigen::Vector3d back = impl_->graph_anchors[p] - impl_->anchors[p];
    Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
    J.bottomLeftCorner<1, 2>() = -back.transpose() * impl_->states.planes.now[p].B;
    blocks[i] = (J * blocks[i] * J.transpose()).eval();
  }
  return blocks;
}

std::vector<Eigen::Matrix3d> NormalEquations::surfel_covariances(
    const std::vector<std::size_t>& indices) {
  return blocks_of<3>(*impl_->matrix, indices, impl_->states.surfels);
}

Eigen::MatrixXd NormalEquations::joint_pose_covariance(const std::vector<std::size_t>& indices) {
  std::vector<int> variables;
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const int variable = impl_->states.poses.variable[indices[i]];
    if (variable == kHeld) continue;
    variables.push_back(variable);
    for (int k = 0; k < 6; ++k) rows.push_back(static_cast<Eigen::Index>(6 * i) + k);
  }
  const auto size = static_cast<Eigen::Index>(6 * indices.size());
  Eigen::MatrixXd joint = Eigen::MatrixXd::Zero(size, size);
  const Eigen::MatrixXd free = impl_->matrix->inverse_of(variables);
  for (Eigen::Index a = 0; a < free.rows(); ++a) {
    for (Eigen::Index b = 0; b < free.cols(); ++b) {
      joint(rows[std::size_t(a)], rows[std::size_t(b)]) = free(a, b);
    }
  }
  return joint;
}

}  // namespace lamina
