// Parameter blocks, residual blocks, elimination groups.
#include <lamina/backend/solver/ceres/ceres_engine.hpp>

#include <ceres/ceres.h>

#include <lamina/backend/graph/factors/gravity.hpp>
#include <lamina/backend/graph/factors/odometry.hpp>
#include <lamina/backend/graph/factors/plane_moments.hpp>
#include <lamina/backend/graph/factors/prior.hpp>
#include <lamina/backend/graph/factors/segment.hpp>
#include <lamina/backend/graph/factors/surfel_moments.hpp>
#include <lamina/backend/graph/factors/surfel_parent.hpp>
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

/// Stops on the absolute change of chi-squared, which Ceres' relative rule cannot say.
class AbsoluteStop final : public ceres::IterationCallback {
 public:
  explicit AbsoluteStop(double chi2_tolerance) : half_tolerance_(0.5 * chi2_tolerance) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    const bool small = summary.iteration > 0 && summary.step_is_successful &&
                       summary.cost_change >= 0 && summary.cost_change < half_tolerance_;
    return small ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  double half_tolerance_;
};

}  // namespace

struct CeresGraph::Impl {
  std::vector<Block<PoseState>> poses;
  std::vector<Block<PlaneState>> planes;
  std::vector<Block<FlatState>> surfels, extrinsics;
  PoseManifold pose_manifold;
  PlaneManifold plane_manifold;
  std::unique_ptr<ceres::Problem> problem;

  explicit Impl(const Graph& graph);
  void add_blocks(const Graph& graph);
  void add_pose_factors(const Graph& graph);
  void add_plane_factors(const Graph& graph);
  void add_surfel_factors(const Graph& graph);
  double* pose(const Graph& g, KeyframeId id) {
    return poses[index_in(g.keyframes, g.at(id))].data();
  }
  double* plane(const Graph& g, PlaneId id) { return planes[index_in(g.planes, g.at(id))].data(); }
  double* surfel(const Graph& g, SurfelId id) {
    return surfels[index_in(g.surfels, g.at(id))].data();
  }
};

CeresGraph::Impl::Impl(const Graph& graph) {
  ceres::Problem::Options options;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem = std::make_unique<ceres::Problem>(options);
  add_blocks(graph);
  add_pose_factors(graph);
  add_plane_factors(graph);
  add_surfel_factors(graph);
}

void CeresGraph::Impl::add_blocks(const Graph& graph) {
  poses.resize(graph.keyframes.size());
  planes.resize(graph.planes.size());
  surfels.resize(graph.surfels.size());
  extrinsics.resize(graph.extrinsics.size());
  const auto add = [this](auto& block, ceres::Manifold* manifold, bool held) {
    problem->AddParameterBlock(block.data(), static_cast<int>(block.size()), manifold);
    if (held) problem->SetParameterBlockConstant(block.data());
  };
  for (std::size_t i = 0; i < poses.size(); ++i) {
    PoseState(graph.keyframes[i].T_map_body).write(poses[i].data());
    add(poses[i], &pose_manifold, graph.keyframes[i].fixed);
  }
  for (std::size_t i = 0; i < planes.size(); ++i) {
    PlaneState(graph.planes[i].plane_anchor).write(planes[i].data());
    add(planes[i], &plane_manifold, graph.planes[i].fixed || !graph.planes[i].active);
  }
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    FlatState(graph.surfels[i].state).write(surfels[i].data());
    add(surfels[i], nullptr, false);
  }
  for (std::size_t i = 0; i < extrinsics.size(); ++i) {
    FlatState(graph.extrinsics[i].state).write(extrinsics[i].data());
    add(extrinsics[i], nullptr, !graph.extrinsics[i].estimate);
    if (graph.extrinsics[i].estimate) {
      problem->AddResidualBlock(make_cost(ExtrinsicsPriorTerm(graph.extrinsics[i])), nullptr,
                                extrinsics[i].data());
    }
  }
}

namespace {
ceres::LossFunction* weighted(double weight) {
  if (weight == 1.0) return nullptr;
  return new ceres::ScaledLoss(nullptr, weight, ceres::TAKE_OWNERSHIP);
}
}  // namespace

void CeresGraph::Impl::add_pose_factors(const Graph& g) {
  for (const auto& f : g.odometry) {
    problem->AddResidualBlock(make_cost(OdometryTerm(f)), nullptr, pose(g, f.from), pose(g, f.to));
  }
  for (const auto& f : g.planar_odometry) {
    problem->AddResidualBlock(make_cost(PlanarOdometryTerm(f)), nullptr, pose(g, f.from),
                              pose(g, f.to));
  }
  for (const auto& f : g.loops) {
    if (!(f.weight > 0)) continue;
    problem->AddResidualBlock(make_cost(OdometryTerm(f)), weighted(f.weight), pose(g, f.from),
                              pose(g, f.to));
  }
  for (const auto& f : g.priors) {
    problem->AddResidualBlock(make_cost(PriorTerm(f)), nullptr, pose(g, f.keyframe));
  }
  for (const auto& f : g.gravity) {
    problem->AddResidualBlock(make_cost(GravityTerm(f)), nullptr, pose(g, f.keyframe));
  }
  for (const auto& f : g.marginal_priors) {
    std::vector<double*> blocks;
    for (const auto id : f.keyframes) blocks.push_back(pose(g, id));
    for (const auto id : f.planes) blocks.push_back(plane(g, id));
    for (const auto id : f.surfels) blocks.push_back(surfel(g, id));
    problem->AddResidualBlock(make_cost(f), nullptr, blocks);
  }
}

void CeresGraph::Impl::add_plane_factors(const Graph& g) {
  for (const auto& f : g.plane_moments) {
    if (!(f.weight > 0)) continue;
    const Eigen::Vector3d& anchor = g.at(f.plane).anchor_map;
    if (f.extrinsics == ExtrinsicsId::kNone) {
      problem->AddResidualBlock(make_cost(PlaneMomentsTerm(f.moments_body, anchor)),
                                weighted(f.weight), pose(g, f.keyframe), plane(g, f.plane));
      continue;
    }
    const Extrinsics& sensor = g.at(f.extrinsics);
    problem->AddResidualBlock(make_cost(PlaneMomentsExtrinsicsTerm(
                                  f.moments_body, anchor, sensor.T_body_sensor.translation())),
                              weighted(f.weight), pose(g, f.keyframe), plane(g, f.plane),
                              extrinsics[index_in(g.extrinsics, sensor)].data());
  }
  for (const auto& f : g.segments) {
    if (!(f.weight > 0)) continue;
    problem->AddResidualBlock(make_cost(SegmentTerm(f, g.at(f.plane).anchor_map)),
                              weighted(f.weight), pose(g, f.keyframe), plane(g, f.plane));
  }
}

void CeresGraph::Impl::add_surfel_factors(const Graph& g) {
  for (const auto& f : g.surfel_moments) {
    const SurfelLandmark& s = g.at(f.surfel);
    if (f.keyframe == s.anchor) {
      problem->AddResidualBlock(make_cost(SurfelMomentsOwnTerm(f.moments_body, s.T_body_cell)),
                                nullptr, surfel(g, f.surfel));
      continue;
    }
    problem->AddResidualBlock(make_cost(SurfelMomentsTerm(f.moments_body, s.T_body_cell)), nullptr,
                              pose(g, f.keyframe), pose(g, s.anchor), surfel(g, f.surfel));
  }
  for (const auto& f : g.surfel_parents) {
    const SurfelLandmark& s = g.at(f.surfel);
    problem->AddResidualBlock(
        make_cost(SurfelParentTerm(f, s.T_body_cell, g.at(f.plane).anchor_map)),
        new ceres::CauchyLoss(kSurfelParentScale), pose(g, s.anchor), plane(g, f.plane),
        surfel(g, f.surfel));
  }
}

SolverChoice choose_solver(const Graph& graph) {
  SolverChoice choice;
  const std::size_t poses = graph.keyframes.size();
  const std::size_t small = std::max(graph.planes.size(), graph.surfels.size());
  if (poses <= 100 && small >= 2 * poses && small > 0) {
    choice.kind = SolverChoice::Kind::kSchur;
    choice.eliminate_surfels = graph.surfels.size() >= graph.planes.size();
    choice.why = "few poses, many landmarks: landmarks eliminated first";
  } else {
    choice.why = "a chain of poses: normal equations, minimum degree";
  }
  return choice;
}

CeresGraph::CeresGraph(const Graph& graph) : impl_(std::make_unique<Impl>(graph)) {}
CeresGraph::~CeresGraph() = default;
ceres::Problem& CeresGraph::problem() { return *impl_->problem; }

namespace {

// Nothing but AbsoluteStop ends a solve early.
ceres::Solver::Options solver_options(const MinimizerOptions& options) {
  ceres::Solver::Options ceres_options;
  ceres_options.num_threads = 1;
  ceres_options.logging_type = ceres::SILENT;
  ceres_options.max_num_iterations = options.max_iterations;
  ceres_options.initial_trust_region_radius = 1e8;
  ceres_options.max_trust_region_radius = 1e16;
  ceres_options.function_tolerance = 0;
  ceres_options.gradient_tolerance = 0;
  ceres_options.parameter_tolerance = 0;
  ceres_options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  ceres_options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  return ceres_options;
}

}  // namespace

MinimizerResult CeresGraph::solve(const MinimizerOptions& options, const SolverChoice& choice) {
  MinimizerResult result;
  if (impl_->problem->NumResidualBlocks() == 0) return result;
  ceres::Solver::Options ceres_options = solver_options(options);
  if (choice.kind == SolverChoice::Kind::kSchur) {
    ceres_options.linear_solver_type = ceres::SPARSE_SCHUR;
    auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    const auto add = [&](auto& blocks, int group) {
      for (auto& block : blocks) ordering->AddElementToGroup(block.data(), group);
    };
    add(impl_->surfels, choice.eliminate_surfels ? 0 : 1);
    add(impl_->planes, choice.eliminate_surfels ? 1 : 0);
    add(impl_->poses, 1);
    add(impl_->extrinsics, 1);
    ceres_options.linear_solver_ordering = ordering;
  }
  AbsoluteStop stop(options.chi2_tolerance);
  ceres_options.callbacks.push_back(&stop);
  ceres::Solver::Summary summary;
  ceres::Solve(ceres_options, impl_->problem.get(), &summary);
  result.iterations = static_cast<int>(summary.iterations.size()) - 1;
  switch (summary.termination_type) {
    case ceres::CONVERGENCE:
    case ceres::USER_SUCCESS:
      result.status = SolveStatus::kConverged;
      break;
    case ceres::NO_CONVERGENCE:
      result.status = SolveStatus::kMaxIterations;
      break;
    default:
      result.status = SolveStatus::kStalled;
  }
  return result;
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
    graph.extrinsics[i].state = FlatState(impl_->extrinsics[i].data()).x;
  }
}

}  // namespace lamina
