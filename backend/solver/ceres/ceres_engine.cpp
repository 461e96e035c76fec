// Elimination groups, and the stopping rule of the native engine told to Ceres.
#include <lamina/backend/solver/ceres/ceres_engine.hpp>

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include <lamina/backend/graph/states.hpp>
#include <lamina/backend/solver/native/native_engine.hpp>

namespace lamina {
namespace {

// Nothing but the callback and the number of iterations ends a solve.
ceres::Solver::Options solver_options(const MinimizerOptions& options) {
  ceres::Solver::Options o;
  o.num_threads = 1;
  o.logging_type = ceres::SILENT;
  o.max_num_iterations = options.max_iterations;
  o.max_trust_region_radius = 1e16;
  o.initial_trust_region_radius = std::min(1e12, 1 / options.initial_damping);
  o.min_trust_region_radius = 1 / options.max_damping;
  o.function_tolerance = 0;
  o.gradient_tolerance = 0;
  o.parameter_tolerance = 0;
  o.update_state_every_iteration = true;
  o.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  o.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  return o;
}

void eliminate_first(const SolverChoice& choice, CeresGraph& problem, ceres::Solver::Options& o) {
  if (choice.kind != SolverChoice::Kind::kSchur) return;
  o.linear_solver_type = ceres::SPARSE_SCHUR;
  o.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  const SizesOfGraph sizes = problem.sizes();
  const auto put = [&](double* block, int group) {
    o.linear_solver_ordering->AddElementToGroup(block, group);
  };
  for (std::size_t i = 0; i < sizes.surfels; ++i) {
    put(problem.surfel(i), choice.eliminate_surfels ? 0 : 1);
  }
  for (std::size_t i = 0; i < sizes.planes; ++i) {
    put(problem.plane(i), choice.eliminate_surfels ? 1 : 0);
  }
  for (std::size_t i = 0; i < sizes.keyframes; ++i) put(problem.pose(i), 1);
  for (std::size_t i = 0; i < sizes.extrinsics; ++i) put(problem.extrinsics(i), 1);
  for (std::size_t i = 0; i < sizes.custom; ++i) put(problem.custom(i), 1);
}

/// Follows a solve, step by step, and ends it.
class Watch final : public ceres::IterationCallback {
 public:
  Watch(const MinimizerOptions& options, const lamina::IterationCallback& progress,
        const LongPath& path, CeresGraph& problem)
      : options_(options), progress_(progress), path_(path), problem_(problem) {
    remember_turns();
  }
  SolveStatus status = SolveStatus::kMaxIterations;
  bool turns_too_far = false;

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (summary.iteration == 0) {
      cost_ = 2 * summary.cost;
      return ceres::SOLVER_CONTINUE;
    }
    Iteration report = describe(summary);
    if (summary.iteration == 1 && std::isfinite(path_.largest_first_turn) &&
        (!report.accepted || report.largest_turn > path_.largest_first_turn)) {
      turns_too_far = true;
      return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    }
    const bool last = report.predicted_decrease <
                      std::max(options_.chi2_tolerance, options_.relative_tolerance * cost_);
    cost_ = report.cost;
    if (last) status = SolveStatus::kConverged;
    const bool go_on = !progress_ || progress_(report);
    if (!go_on && !last) status = SolveStatus::kCancelled;
    return last || !go_on || out_of_steps(report.accepted) ? ceres::SOLVER_TERMINATE_SUCCESSFULLY
                                                           : ceres::SOLVER_CONTINUE;
  }

 private:
  Iteration describe(const ceres::IterationSummary& summary) {
    Iteration report;
    report.number = summary.iteration;
    report.accepted = summary.step_is_successful;
    report.cost = 2 * summary.cost;
    report.damping = 1 / summary.trust_region_radius;
    // relative_decrease: of the cost's change to the model's.
    const double ratio = summary.relative_decrease;
    report.predicted_decrease = ratio != 0 ? std::abs(2 * summary.cost_change / ratio) : 0;
    if (report.accepted) report.largest_turn = remember_turns();
    return report;
  }
  /// The largest turn since it was called last, rad.
  double remember_turns() {
    double most = 0;
    const std::size_t count = problem_.sizes().keyframes;
    turns_.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Quaterniond now = PoseState(problem_.pose(i)).q;
      most = std::max(most, turns_[i].angularDistance(now));
      turns_[i] = now;
    }
    return most;
  }
  bool out_of_steps(bool accepted) {
    if (accepted) return ++steps_ >= options_.max_steps;
    if (++rejections_ < options_.max_rejections) return false;
    status = SolveStatus::kStalled;
    return true;
  }

  const MinimizerOptions& options_;
  const lamina::IterationCallback& progress_;
  const LongPath& path_;
  CeresGraph& problem_;
  std::vector<Eigen::Quaterniond> turns_;
  double cost_ = 0;
  int steps_ = 0, rejections_ = 0;
};

}  // namespace

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

CeresEngine::CeresEngine(const Graph& graph, Parts parts)
    : CeresEngine(graph, parts, choose_solver(graph)) {}

CeresEngine::CeresEngine(const Graph& graph, Parts parts, SolverChoice choice)
    : graph_(graph), choice_(std::move(choice)), problem_(graph, parts) {}

RobustWeights CeresEngine::chi_squared() const {
  problem_.write(graph_);
  RobustWeights all = chi_squared_of(graph_);
  const auto drop_those_left_out = [](const auto& factors, std::vector<double>& chi2) {
    for (std::size_t i = 0; i < chi2.size(); ++i) {
      if (!(factors[i].weight > 0)) chi2[i] = 0;
    }
  };
  drop_those_left_out(graph_.plane_moments, all.plane_moments);
  drop_those_left_out(graph_.segments, all.segments);
  drop_those_left_out(graph_.loops, all.loops);
  drop_those_left_out(graph_.custom, all.custom);
  return all;
}

MinimizerResult CeresEngine::minimize(const MinimizerOptions& options,
                                      const IterationCallback& progress, const LongPath& path) {
  MinimizerResult result;
  result.initial_cost = result.final_cost = cost();
  if (dimension() == 0 || problem_.problem().NumResidualBlocks() == 0) return result;
  if (!std::isfinite(total(result.initial_cost))) {
    result.status = SolveStatus::kInvalidInput;
    return result;
  }
  problem_.write(graph_);  // to come back to
  ceres::Solver::Options o = solver_options(options);
  eliminate_first(choice_, problem_, o);
  Watch watch(options, progress, path, problem_);
  o.callbacks.push_back(&watch);
  ceres::Solver::Summary summary;
  ceres::Solve(o, &problem_.problem(), &summary);
  result.iterations = std::max(0, static_cast<int>(summary.iterations.size()) - 1);
  result.status = watch.status;
  result.turns_too_far = watch.turns_too_far;
  const bool failed = summary.termination_type == ceres::FAILURE;
  // CONVERGENCE by itself: the trust region shrank to nothing.
  if (failed || summary.termination_type == ceres::CONVERGENCE) {
    result.status = SolveStatus::kStalled;
  }
  result.final_cost = cost();
  if (result.turns_too_far || !std::isfinite(total(result.final_cost))) {
    problem_.read(graph_);
    result.final_cost = result.initial_cost;
  }
  return result;
}

bool CeresEngine::let_positions_follow() {
  problem_.hold_turns(true);
  MinimizerOptions once;
  once.max_iterations = 1;
  const SolveStatus status = minimize(once).status;
  problem_.hold_turns(false);
  return status != SolveStatus::kStalled && status != SolveStatus::kInvalidInput;
}

int CeresEngine::rank_deficiency() {
  problem_.write(graph_);
  NormalEquations equations(graph_);
  return equations.dimension() == 0 ? 0 : lamina::rank_deficiency(equations);
}

std::string CeresEngine::description() const {
  return std::string("Ceres, ") +
         (choice_.kind == SolverChoice::Kind::kSchur ? "SPARSE_SCHUR" : "SPARSE_NORMAL_CHOLESKY") +
         " (SuiteSparse): " + choice_.why;
}

}  // namespace lamina
