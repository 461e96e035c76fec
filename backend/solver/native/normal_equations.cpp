// Cost, steps, weights and covariances of what normal_equations_terms.cpp took from the graph.
#include <lamina/backend/solver/native/normal_equations_impl.hpp>

#include <limits>

namespace lamina {

using namespace detail;

NormalEquations::NormalEquations(const Graph& graph, Parts parts)
    : impl_(std::make_unique<Impl>(graph, parts)) {}
NormalEquations::~NormalEquations() = default;

int NormalEquations::dimension() const { return impl_->matrix->dimension(); }

void NormalEquations::set_weights(const RobustWeights& weights) {
  const auto pick = [](const std::vector<double>& all, const std::vector<std::size_t>& factors,
                       std::vector<double>& out) {
    for (std::size_t i = 0; i < factors.size(); ++i) out[i] = all[factors[i]];
  };
  pick(weights.loops, impl_->loop_factor, impl_->loop_weights);
  pick(weights.loops, impl_->loop_of_sensor_factor, impl_->loop_of_sensor_weights);
  pick(weights.segments, impl_->segment_factor, impl_->segment_weights);
  pick(weights.plane_moments, impl_->moments_factor, impl_->moments_weights);
  pick(weights.plane_moments, impl_->moments_of_sensor_factor, impl_->moments_of_sensor_weights);
  for (auto& custom : impl_->customs) {
    if (custom.factor.may_be_wrong) custom.factor.weight = weights.custom[custom.index];
  }
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
    for (std::size_t i = 0; i < factors.size(); ++i) out[factors[i]] += chi2[i];
  };
  put(impl_->loops, impl_->loop_factor, all.loops);
  put(impl_->loops_of_sensor, impl_->loop_of_sensor_factor, all.loops);
  put(impl_->segments, impl_->segment_factor, all.segments);
  put(impl_->moments, impl_->moments_factor, all.plane_moments);
  put(impl_->moments_of_sensor, impl_->moments_of_sensor_factor, all.plane_moments);
  all.custom.resize(impl_->custom_count);
  for (const auto& custom : impl_->customs) {
    CustomEvaluation e;
    if (!custom.factor.may_be_wrong) continue;
    const bool evaluated = impl_->evaluate_blocks(custom, false, e);
    all.custom[custom.index] =
        evaluated ? e.chi_squared_of_three() : std::numeric_limits<double>::infinity();
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

void NormalEquations::step(const Eigen::VectorXd& d, bool further) {
  if (!further) impl_->anchors_before = impl_->anchors;
  std::vector<Eigen::Vector3d> normals;
  for (const PlaneState& plane : impl_->states.planes.now) normals.push_back(plane.n);
  impl_->each_kind([&](auto& kind) {
    using State = typename std::decay_t<decltype(kind.now)>::value_type;
    if (!further) kind.before = kind.now;
    for (std::size_t i = 0; i < kind.now.size(); ++i) {
      if (kind.variable[i] == kHeld) continue;
      const int row = impl_->matrix->row_of(kind.variable[i]);
      if (impl_->states.turns_only) {
        using Columns = TurningColumns<State>;
        Eigen::Matrix<double, State::kTangent, 1> turn;
        turn.setZero();
        turn.template segment<Columns::kCount>(Columns::kFirst) =
            d.template segment<Columns::kCount>(row);
        kind.now[i] = kind.now[i].plus(turn);
      } else {
        kind.now[i] = kind.now[i].plus(d.template segment<State::kTangent>(row));
      }
    }
  });
  if (!further) impl_->own_before = impl_->own_now;
  for (std::size_t i = 0; i < impl_->own_now.size(); ++i) {
    if (impl_->own_variable[i] == kHeld) continue;
    CustomState& state = impl_->own_now[i];
    const int row = impl_->matrix->row_of(impl_->own_variable[i]);
    state.values = plus(state, d.segment(row, state.tangent()));
  }
  impl_->carry_anchors(normals);
}

Eigen::VectorXd NormalEquations::turning() const {
  if (impl_->states.turns_only) return Eigen::VectorXd::Ones(dimension());
  Eigen::VectorXd turns = Eigen::VectorXd::Zero(dimension());
  const auto mark = [&]<class State>(const States<State>& kind) {
    using Columns = TurningColumns<State>;
    for (const int variable : kind.variable) {
      if (variable == kHeld) continue;
      turns.segment<Columns::kCount>(impl_->matrix->row_of(variable) + Columns::kFirst).setOnes();
    }
  };
  mark(impl_->states.poses);
  mark(impl_->states.planes);
  mark(impl_->states.extrinsics);
  return turns;
}

double NormalEquations::largest_turn(const Eigen::VectorXd& d) const {
  const int first = impl_->states.turns_only ? 0 : TurningColumns<PoseState>::kFirst;
  double most = 0;
  for (const int variable : impl_->states.poses.variable) {
    if (variable == kHeld) continue;
    most = std::max(most, d.segment<3>(impl_->matrix->row_of(variable) + first).norm());
  }
  return most;
}

void NormalEquations::undo_step() {
  impl_->each_kind([](auto& kind) { kind.now.swap(kind.before); });
  impl_->own_now.swap(impl_->own_before);
  impl_->anchors.swap(impl_->anchors_before);
  impl_->tell_anchors();
}

void NormalEquations::read(const Graph& graph) {
  AllStates& s = impl_->states;
  for (std::size_t i = 0; i < graph.keyframes.size(); ++i) {
    s.poses.now[i] = PoseState(graph.keyframes[i].T_map_body);
  }
  for (std::size_t i = 0; i < graph.planes.size(); ++i) {
    s.planes.now[i] = PlaneState(graph.planes[i].plane_anchor);
  }
  for (std::size_t i = 0; i < graph.surfels.size(); ++i) {
    s.surfels.now[i] = FlatState(graph.surfels[i].state);
  }
  for (std::size_t i = 0; i < graph.extrinsics.size(); ++i) {
    s.extrinsics.now[i] = PoseState(graph.extrinsics[i].state);
  }
  impl_->own_now = graph.custom_states;
  impl_->anchors = impl_->graph_anchors;
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
    if (s.extrinsics.variable[i] != kHeld) graph.extrinsics[i].state = s.extrinsics.now[i].se3();
  }
  for (std::size_t i = 0; i < graph.custom_states.size(); ++i) {
    if (impl_->own_variable[i] != kHeld) graph.custom_states[i].values = impl_->own_now[i].values;
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

namespace {
// Of states of six numbers, cross terms included.
Eigen::MatrixXd joint_of(BlockCholesky& matrix, const std::vector<std::size_t>& indices,
                         const States<PoseState>& kind) {
  std::vector<int> variables;
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const int variable = kind.variable[indices[i]];
    if (variable == kHeld) continue;
    variables.push_back(variable);
    for (int k = 0; k < 6; ++k) rows.push_back(static_cast<Eigen::Index>(6 * i) + k);
  }
  const auto size = static_cast<Eigen::Index>(6 * indices.size());
  Eigen::MatrixXd joint = Eigen::MatrixXd::Zero(size, size);
  const Eigen::MatrixXd free = matrix.inverse_of(variables);
  for (Eigen::Index a = 0; a < free.rows(); ++a) {
    for (Eigen::Index b = 0; b < free.cols(); ++b) {
      joint(rows[std::size_t(a)], rows[std::size_t(b)]) = free(a, b);
    }
  }
  return joint;
}
}  // namespace

Eigen::MatrixXd NormalEquations::joint_pose_covariance(const std::vector<std::size_t>& indices) {
  return joint_of(*impl_->matrix, indices, impl_->states.poses);
}

Eigen::MatrixXd NormalEquations::joint_extrinsics_covariance(
    const std::vector<std::size_t>& indices) {
  return joint_of(*impl_->matrix, indices, impl_->states.extrinsics);
}

std::vector<Matrix6d> NormalEquations::plane_pair_covariances(
    const std::vector<std::pair<std::size_t, std::size_t>>& pairs) {
  const auto& variable = impl_->states.planes.variable;
  std::vector<std::pair<int, int>> free;  // pairs of which neither is held
  for (const auto& [a, b] : pairs) {
    if (variable[a] != kHeld && variable[b] != kHeld) free.emplace_back(variable[a], variable[b]);
  }
  const auto found = impl_->matrix->inverse_of_pairs(free);
  std::vector<Matrix6d> all;
  std::size_t next = 0;
  for (const auto& [a, b] : pairs) {
    Matrix6d C = Matrix6d::Zero();
    if (variable[a] != kHeld && variable[b] != kHeld) {
      if (next < found.size()) C = found[next++];
    } else if (variable[a] != kHeld) {
      C.topLeftCorner<3, 3>() = impl_->matrix->inverse_of({&variable[a], 1});
    } else if (variable[b] != kHeld) {
      C.bottomRightCorner<3, 3>() = impl_->matrix->inverse_of({&variable[b], 1});
    }
    Matrix6d J = Matrix6d::Identity();
    for (int i = 0; i < 2; ++i) {
      const std::size_t p = i == 0 ? a : b;
      const Eigen::Vector3d back = impl_->graph_anchors[p] - impl_->anchors[p];
      J.block<1, 2>(3 * i + 2, 3 * i) = -back.transpose() * impl_->states.planes.now[p].B;
    }
    all.push_back(J * C * J.transpose());
  }
  return all;
}

}  // namespace lamina
