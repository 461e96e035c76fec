// Parameter blocks and residual blocks.
#include <lamina/backend/solver/ceres/ceres_graph.hpp>

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <limits>
#include <type_traits>
#include <utility>

#include <lamina/backend/graph/factors/gravity.hpp>
#include <lamina/backend/graph/factors/of_sensor.hpp>
#include <lamina/backend/graph/factors/prior.hpp>
#include <lamina/backend/graph/factors/segment.hpp>
#include <lamina/backend/graph/factors/surfel_moments.hpp>
#include <lamina/backend/graph/factors/surfel_parent.hpp>
#include <lamina/backend/graph/turns.hpp>
#include <lamina/backend/solver/ceres/costs.hpp>
#include <lamina/backend/solver/ceres/manifolds.hpp>

namespace lamina {
namespace {

template <class State>
using Block = std::array<double, static_cast<std::size_t>(State::kAmbient)>;

template <class StateVector, class State>
std::size_t index_in(const StateVector& states, const State& state) {
  return static_cast<std::size_t>(&state - states.data());
}

/// A factor's weight, where it may change.
class Weighted final : public ceres::LossFunction {
 public:
  explicit Weighted(const double& weight) : weight_(&weight) {}
  void Evaluate(double chi2, double* rho) const override {
    rho[0] = *weight_ * chi2;
    rho[1] = *weight_;
    rho[2] = 0;
  }

 private:
  const double* weight_;
};

/// A cost function that the graph goes on owning.
class SharedCost final : public ceres::CostFunction {
 public:
  explicit SharedCost(std::shared_ptr<ceres::CostFunction> cost) : cost_(std::move(cost)) {
    set_num_residuals(cost_->num_residuals());
    *mutable_parameter_block_sizes() = cost_->parameter_block_sizes();
  }
  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    return cost_->Evaluate(x, residuals, jacobians);
  }

 private:
  std::shared_ptr<ceres::CostFunction> cost_;
};

/// A loss that the graph goes on owning, times a weight that may change.
class WeightedLoss final : public ceres::LossFunction {
 public:
  WeightedLoss(std::shared_ptr<ceres::LossFunction> loss, const double& weight)
      : loss_(std::move(loss)), weight_(&weight) {}
  void Evaluate(double chi2, double* rho) const override {
    loss_->Evaluate(chi2, rho);
    for (int i = 0; i < 3; ++i) rho[i] *= *weight_;
  }

 private:
  std::shared_ptr<ceres::LossFunction> loss_;
  const double* weight_;
};

}  // namespace

struct CeresGraph::Impl {
  std::vector<Block<PoseState>> poses;
  std::vector<Block<PlaneState>> planes;
  std::vector<Block<FlatState>> surfels;
  std::vector<Block<PoseState>> extrinsics;
  std::vector<CustomState> custom;  ///< their values are the blocks
  std::vector<bool> may_be_wrong;   ///< by custom factor
  StateManifolds manifolds;
  bool turns_only;
  RobustWeights weights;  ///< of the graph's doubtful factors; 0: not taken in
  std::array<std::vector<ceres::ResidualBlockId>, kFactorTypes> residuals;
  std::unique_ptr<ceres::Problem> problem;

  Impl(const Graph& graph, Parts parts);
  template <class... Blocks>
  void add(FactorType type, ceres::CostFunction* cost, ceres::LossFunction* loss,
           Blocks... blocks) {
    residuals[static_cast<std::size_t>(type)].push_back(
        problem->AddResidualBlock(cost, loss, blocks...));
  }
  void add_blocks(const Graph& graph);
  void add_pose_factors(const Graph& graph);
  void add_plane_factors(const Graph& graph);
  void add_surfel_factors(const Graph& graph);
  void add_custom_factors(const Graph& graph);
  double* pose(const Graph& g, KeyframeId id) {
    return poses[index_in(g.keyframes, g.at(id))].data();
  }
  double* plane(const Graph& g, PlaneId id) { return planes[index_in(g.planes, g.at(id))].data(); }
  double* surfel(const Graph& g, SurfelId id) {
    return surfels[index_in(g.surfels, g.at(id))].data();
  }
};

CeresGraph::Impl::Impl(const Graph& graph, Parts parts) : turns_only(parts == Parts::kTurns) {
  ceres::Problem::Options options;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem = std::make_unique<ceres::Problem>(options);
  add_blocks(graph);
  add_pose_factors(graph);
  add_plane_factors(graph);
  if (turns_only) return;
  add_surfel_factors(graph);
  add_custom_factors(graph);
}

void CeresGraph::Impl::add_blocks(const Graph& graph) {
  poses.resize(graph.keyframes.size());
  planes.resize(graph.planes.size());
  surfels.resize(graph.surfels.size());
  extrinsics.resize(graph.extrinsics.size());
  const auto add_block = [this](auto& block, ceres::Manifold* manifold, bool held) {
    problem->AddParameterBlock(block.data(), static_cast<int>(block.size()), manifold);
    if (held) problem->SetParameterBlockConstant(block.data());
  };
  StateManifolds& m = manifolds;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    PoseState(graph.keyframes[i].T_map_body).write(poses[i].data());
    add_block(poses[i], turns_only ? &m.pose_turn : static_cast<ceres::Manifold*>(&m.pose),
              graph.keyframes[i].fixed);
  }
  for (std::size_t i = 0; i < planes.size(); ++i) {
    PlaneState(graph.planes[i].plane_anchor).write(planes[i].data());
    add_block(planes[i], turns_only ? &m.plane_turn : static_cast<ceres::Manifold*>(&m.plane),
              graph.planes[i].fixed || !graph.planes[i].active);
  }
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    FlatState(graph.surfels[i].state).write(surfels[i].data());
    add_block(surfels[i], nullptr, turns_only);
  }
  for (std::size_t i = 0; i < extrinsics.size(); ++i) {
    PoseState(graph.extrinsics[i].state).write(extrinsics[i].data());
    add_block(extrinsics[i], &m.pose, !graph.extrinsics[i].estimate || turns_only);
    if (graph.extrinsics[i].estimate) {
      add(FactorType::kPrior, make_cost(PriorTerm(graph.extrinsics[i])), nullptr,
          extrinsics[i].data());
    }
  }
}

void CeresGraph::Impl::add_custom_factors(const Graph& g) {
  custom = g.custom_states;
  for (CustomState& state : custom) {
    problem->AddParameterBlock(state.values.data(), state.ambient(),
                               const_cast<ceres::Manifold*>(state.manifold.get()));
    if (state.fixed) problem->SetParameterBlockConstant(state.values.data());
  }
  const auto block = [&](auto id) -> double* {
    if constexpr (std::is_same_v<decltype(id), KeyframeId>) {
      return pose(g, id);
    } else {
      return custom[index_in(g.custom_states, g.at(id))].values.data();
    }
  };
  weights.custom.assign(g.custom.size(), 0);
  for (std::size_t i = 0; i < g.custom.size(); ++i) {
    const CustomFactor& f = g.custom[i];
    may_be_wrong.push_back(f.may_be_wrong);
    if (!(f.weight > 0)) continue;
    weights.custom[i] = f.weight;
    std::vector<double*> blocks;
    for (const StateRef& state : f.states) blocks.push_back(std::visit(block, state));
    ceres::LossFunction* loss = nullptr;
    if (f.loss) {
      loss = new WeightedLoss(f.loss, weights.custom[i]);
    } else {
      loss = new Weighted(weights.custom[i]);
    }
    add(FactorType::kCustom, new SharedCost(f.cost), loss, blocks);
  }
}

void CeresGraph::Impl::add_pose_factors(const Graph& g) {
  const auto observed = [this](auto factor, int positions) {
    return turns_only ? without_positions(std::move(factor), positions) : factor;
  };
  const auto add_motion = [&](FactorType type, const auto& f, ceres::LossFunction* loss) {
    if (const Extrinsics* e = moving_sensor(g, f.extrinsics)) {
      add(type, make_cost(OdometryOfSensorTerm(observed(f, 3), *e)), loss, pose(g, f.from),
          pose(g, f.to), extrinsics[index_in(g.extrinsics, *e)].data());
    } else {
      add(type, make_cost(OdometryTerm(observed(f, 3))), loss, pose(g, f.from), pose(g, f.to));
    }
  };
  for (const auto& f : g.odometry) add_motion(FactorType::kOdometry, f, nullptr);
  for (const auto& f : g.planar_odometry) {
    add(FactorType::kPlanarOdometry, make_cost(PlanarOdometryTerm(observed(f, 2))), nullptr,
        pose(g, f.from), pose(g, f.to));
  }
  weights.loops.assign(g.loops.size(), 0);
  for (std::size_t i = 0; i < g.loops.size(); ++i) {
    const LoopFactor& f = g.loops[i];
    if (!(f.weight > 0)) continue;
    weights.loops[i] = f.weight;
    add_motion(FactorType::kLoop, f, new Weighted(weights.loops[i]));
  }
  for (const auto& f : g.priors) {
    add(FactorType::kPrior, make_cost(PriorTerm(observed(f, 3))), nullptr, pose(g, f.keyframe));
  }
  for (const auto& f : g.gravity) {
    add(FactorType::kGravity, make_cost(GravityTerm(f)), nullptr, pose(g, f.keyframe));
  }
  for (const auto& f : g.marginal_priors) {
    std::vector<double*> blocks;
    for (const auto id : f.keyframes) blocks.push_back(pose(g, id));
    for (const auto id : f.planes) blocks.push_back(plane(g, id));
    for (const auto id : f.surfels) blocks.push_back(surfel(g, id));
    add(FactorType::kMarginalPrior, make_cost(f), nullptr, blocks);
  }
}

void CeresGraph::Impl::add_plane_factors(const Graph& g) {
  weights.plane_moments.assign(g.plane_moments.size(), 0);
  for (std::size_t i = 0; i < g.plane_moments.size(); ++i) {
    const PlaneMomentsFactor& f = g.plane_moments[i];
    if (!(f.weight > 0)) continue;
    weights.plane_moments[i] = f.weight;
    const Eigen::Vector3d& anchor = g.at(f.plane).anchor_map;
    for_each_part(g, f, [&](const Moments& part, const Extrinsics* sensor) {
      ceres::LossFunction* loss = new Weighted(weights.plane_moments[i]);
      const Moments moments = turns_only ? without_positions(part) : part;
      if (sensor == nullptr) {
        add(FactorType::kPlaneMoments, make_cost(PlaneMomentsTerm(moments, anchor)), loss,
            pose(g, f.keyframe), plane(g, f.plane));
      } else {
        add(FactorType::kPlaneMoments,
            make_cost(PlaneMomentsOfSensorTerm(moments, anchor, *sensor)), loss,
            pose(g, f.keyframe), plane(g, f.plane),
            extrinsics[index_in(g.extrinsics, *sensor)].data());
      }
    });
  }
  weights.segments.assign(g.segments.size(), 0);
  for (std::size_t i = 0; i < g.segments.size(); ++i) {
    SegmentFactor f = g.segments[i];
    if (!(f.weight > 0)) continue;
    weights.segments[i] = f.weight;
    if (turns_only) f.sqrt_information.col(1).setZero();
    add(FactorType::kSegment, make_cost(SegmentTerm(f, g.at(f.plane).anchor_map)),
        new Weighted(weights.segments[i]), pose(g, f.keyframe), plane(g, f.plane));
  }
}

void CeresGraph::Impl::add_surfel_factors(const Graph& g) {
  for (const auto& f : g.surfel_moments) {
    const SurfelLandmark& s = g.at(f.surfel);
    if (f.keyframe == s.anchor) {
      add(FactorType::kSurfelMoments,
          make_cost(SurfelMomentsOwnTerm(f.moments_body, s.T_body_cell)), nullptr,
          surfel(g, f.surfel));
      continue;
    }
    add(FactorType::kSurfelMoments, make_cost(SurfelMomentsTerm(f.moments_body, s.T_body_cell)),
        nullptr, pose(g, f.keyframe), pose(g, s.anchor), surfel(g, f.surfel));
  }
  for (const auto& f : g.surfel_parents) {
    const SurfelLandmark& s = g.at(f.surfel);
    add(FactorType::kSurfelParent,
        make_cost(SurfelParentTerm(f, s.T_body_cell, g.at(f.plane).anchor_map)),
        new ceres::CauchyLoss(kSurfelParentScale), pose(g, s.anchor), plane(g, f.plane),
        surfel(g, f.surfel));
  }
}

CeresGraph::CeresGraph(const Graph& graph, Parts parts)
    : impl_(std::make_unique<Impl>(graph, parts)) {}
CeresGraph::~CeresGraph() = default;
ceres::Problem& CeresGraph::problem() { return *impl_->problem; }

double* CeresGraph::pose(std::size_t keyframe) { return impl_->poses[keyframe].data(); }
double* CeresGraph::plane(std::size_t plane) { return impl_->planes[plane].data(); }
double* CeresGraph::surfel(std::size_t surfel) { return impl_->surfels[surfel].data(); }
double* CeresGraph::extrinsics(std::size_t sensor) { return impl_->extrinsics[sensor].data(); }
double* CeresGraph::custom(std::size_t state) { return impl_->custom[state].values.data(); }
SizesOfGraph CeresGraph::sizes() const {
  return {impl_->poses.size(), impl_->planes.size(), impl_->surfels.size(),
          impl_->extrinsics.size(), impl_->custom.size()};
}

int CeresGraph::dimension() const {
  std::vector<double*> blocks;
  impl_->problem->GetParameterBlocks(&blocks);
  int columns = 0;
  for (const double* block : blocks) {
    if (!impl_->problem->IsParameterBlockConstant(block)) {
      columns += impl_->problem->ParameterBlockTangentSize(block);
    }
  }
  return columns;
}

CostByType CeresGraph::cost() const {
  CostByType cost{};
  for (std::size_t t = 0; t < cost.size(); ++t) {
    if (impl_->residuals[t].empty()) continue;
    ceres::Problem::EvaluateOptions options;
    options.residual_blocks = impl_->residuals[t];
    double half = 0;
    const bool evaluated = impl_->problem->Evaluate(options, &half, nullptr, nullptr, nullptr);
    cost[t] = evaluated ? 2 * half : std::numeric_limits<double>::infinity();
  }
  return cost;
}

void CeresGraph::set_weights(const RobustWeights& weights) {
  const auto set = [](const std::vector<double>& from, std::vector<double>& to) {
    for (std::size_t i = 0; i < to.size(); ++i) to[i] = from[i];
  };
  set(weights.plane_moments, impl_->weights.plane_moments);
  set(weights.segments, impl_->weights.segments);
  set(weights.loops, impl_->weights.loops);
  for (std::size_t i = 0; i < impl_->weights.custom.size(); ++i) {
    if (impl_->may_be_wrong[i]) impl_->weights.custom[i] = weights.custom[i];
  }
}

void CeresGraph::hold_turns(bool held) {
  StateManifolds& m = impl_->manifolds;
  ceres::Problem& problem = *impl_->problem;
  for (auto& pose : impl_->poses) {
    problem.SetManifold(pose.data(),
                        held ? &m.pose_position : static_cast<ceres::Manifold*>(&m.pose));
  }
  for (auto& plane : impl_->planes) {
    problem.SetManifold(plane.data(),
                        held ? &m.plane_distance : static_cast<ceres::Manifold*>(&m.plane));
  }
  for (auto& sensor : impl_->extrinsics) {
    problem.SetManifold(sensor.data(),
                        held ? &m.pose_position : static_cast<ceres::Manifold*>(&m.pose));
  }
}

void CeresGraph::read(const Graph& graph) {
  for (std::size_t i = 0; i < graph.keyframes.size(); ++i) {
    PoseState(graph.keyframes[i].T_map_body).write(impl_->poses[i].data());
  }
  for (std::size_t i = 0; i < graph.planes.size(); ++i) {
    PlaneState(graph.planes[i].plane_anchor).write(impl_->planes[i].data());
  }
  for (std::size_t i = 0; i < graph.surfels.size(); ++i) {
    FlatState(graph.surfels[i].state).write(impl_->surfels[i].data());
  }
  for (std::size_t i = 0; i < graph.extrinsics.size(); ++i) {
    PoseState(graph.extrinsics[i].state).write(impl_->extrinsics[i].data());
  }
  for (std::size_t i = 0; i < impl_->custom.size(); ++i) {
    Eigen::VectorXd& values = impl_->custom[i].values;  // stays where it is: it is a block
    std::copy_n(graph.custom_states[i].values.data(), values.size(), values.data());
  }
}

void CeresGraph::write(Graph& graph) const {
  for (std::size_t i = 0; i < graph.keyframes.size(); ++i) {
    if (graph.keyframes[i].fixed) continue;
    graph.keyframes[i].T_map_body = PoseState(impl_->poses[i].data()).se3();
  }
  for (std::size_t i = 0; i < graph.planes.size(); ++i) {
    if (graph.planes[i].fixed || !graph.planes[i].active) continue;
    graph.planes[i].set_plane_anchor(PlaneState(impl_->planes[i].data()).plane());
  }
  for (std::size_t i = 0; i < graph.surfels.size(); ++i) {
    graph.surfels[i].state = FlatState(impl_->surfels[i].data()).x;
  }
  for (std::size_t i = 0; i < graph.extrinsics.size(); ++i) {
    if (!graph.extrinsics[i].estimate) continue;
    graph.extrinsics[i].state = PoseState(impl_->extrinsics[i].data()).se3();
  }
  for (std::size_t i = 0; i < impl_->custom.size(); ++i) {
    graph.custom_states[i].values = impl_->custom[i].values;
  }
}

}  // namespace lamina
