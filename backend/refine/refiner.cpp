// Refiner: datum, plain solve, graduated non-convexity, report.
#include <lamina/backend/graph/datum.hpp>
#include <lamina/backend/refine/refiner.hpp>

#include <chrono>
#include <cmath>
#include <map>

#include <lamina/backend/refine/graduated_non_convexity.hpp>
#include <lamina/backend/refine/loop_reconsideration.hpp>
#include <lamina/backend/refine/pinned_solve.hpp>

namespace lamina {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::array<std::size_t, kFactorTypes> counts_of(const Graph& graph) {
  std::array<std::size_t, kFactorTypes> counts{};
  const auto set = [&](FactorType type, std::size_t n) {
    counts[static_cast<std::size_t>(type)] = n;
  };
  set(FactorType::kOdometry, graph.odometry.size());
  set(FactorType::kPlanarOdometry, graph.planar_odometry.size());
  set(FactorType::kLoop, graph.loops.size());
  set(FactorType::kPrior, graph.priors.size());
  set(FactorType::kPlaneMoments, graph.plane_moments.size());
  set(FactorType::kSegment, graph.segments.size());
  set(FactorType::kGravity, graph.gravity.size());
  set(FactorType::kSurfelMoments, graph.surfel_moments.size());
  set(FactorType::kSurfelParent, graph.surfel_parents.size());
  set(FactorType::kMarginalPrior, graph.marginal_priors.size());
  return counts;
}

/// Relative size of a pivot below which a direction counts as unconstrained.
constexpr double kWeakPivot = 1e-11;
/// Relative size of a pivot that no damping of a healthy solve can have made.
constexpr double kCertainPivot = 1e-8;

int rank_deficiency(NormalEquations& equations) {
  equations.linearize();
  const Eigen::VectorXd diagonal = equations.diagonal();
  for (const double damping : {1e-13, 1e-10, 1e-7}) {
    Eigen::VectorXd added = damping * diagonal;
    for (Eigen::Index i = 0; i < added.size(); ++i) {
      if (!(diagonal(i) > 0)) added(i) = 1e-300;  // no factor at all: its pivot is this
    }
    if (equations.factorize(added)) {
      return equations.weak_pivots(std::max(kWeakPivot, 10 * damping));
    }
  }
  return equations.dimension();
}

/// Of the types that the graph has factors of.
std::vector<CostChange> costs_of(const Graph& graph, const RobustOutcome& outcome) {
  std::vector<CostChange> costs;
  const auto counts = counts_of(graph);
  for (int t = 0; t < kFactorTypes; ++t) {
    const auto k = static_cast<std::size_t>(t);
    if (counts[k] == 0) continue;
    costs.push_back(
        {static_cast<FactorType>(t), counts[k], outcome.initial_cost[k], outcome.final_cost[k]});
  }
  return costs;
}

}  // namespace

RefineResult refine(Graph& graph, const RefineOptions& options,
                    const std::function<bool(const RefineProgress&)>& progress) {
  const auto start = std::chrono::steady_clock::now();
  RefineResult result;
  result.problems = graph.problems();
  if (!result.problems.empty()) {
    result.status = SolveStatus::kInvalidInput;
    return result;
  }
  result.held = keyframes_without_datum(graph);
  for (const KeyframeId id : result.held) graph.at(id).fixed = true;
  std::vector<MarginalPrior> priors = hold_what_nothing_tells(graph);
  if (options.planes_from_evidence) fit_planes_to_evidence(graph);

  RobustOutcome pinned;
  if (!options.pinned_views.empty()) {
    solve_pinned(graph, {.loops = {}, .plane_moments = options.pinned_views}, options, pinned);
  }
  RobustOutcome outcome = minimize_robustly(graph, options, progress);
  outcome.iterations += pinned.iterations;
  if (options.thorough) reconsider_loops(graph, options, progress, outcome);
  result.status = outcome.status;
  result.iterations = outcome.iterations;
  result.rounds = outcome.rounds;
  result.rejected = outcome.rejected;
  result.costs = costs_of(graph, outcome);
  NormalEquations& equations = *outcome.equations;
  // The last system of the solve was damped: where even that had no small pivot there is none.
  if (equations.dimension() > 0 && equations.weak_pivots(kCertainPivot) > 0) {
    result.rank_deficiency = rank_deficiency(equations);
  }
  for (const KeyframeId id : result.held) graph.at(id).fixed = false;
  graph.marginal_priors = std::move(priors);
  result.solver = "block Cholesky of the normal equations (CHOLMOD), minimum degree on blocks";
  result.solve_s = seconds_since(start);
  return result;
}

}  // namespace lamina
