// Refiner: datum, plain solve, graduated non-convexity, report.
#include <lamina/backend/graph/datum.hpp>
#include <lamina/backend/refine/refiner.hpp>

#include <chrono>
#include <cmath>
#include <map>
#include <string>

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
  set(FactorType::kCustom, graph.custom.size());
  return counts;
}

struct CustomCost {
  std::size_t factors = 0;
  double cost = 0;
};

/// Of a user's factors, by kind, as they are weighted.
std::map<std::string, CustomCost> custom_costs(const Graph& graph) {
  std::map<std::string, CustomCost> costs;
  for (const CustomFactor& factor : graph.custom) {
    CustomCost& of_kind = costs[factor.kind];
    ++of_kind.factors;
    CustomEvaluation e;
    if (evaluate_at(factor, graph, e)) of_kind.cost += factor.weight * e.robust;
  }
  return costs;
}

/// A line for each of them that cannot be evaluated at the graph's states.
std::vector<std::string> not_evaluable(const Graph& graph) {
  std::vector<std::string> problems;
  for (std::size_t i = 0; i < graph.custom.size(); ++i) {
    CustomEvaluation e;
    if (!(graph.custom[i].weight > 0) || evaluate_at(graph.custom[i], graph, e)) continue;
    problems.push_back("custom factor " + std::to_string(i) + " '" + graph.custom[i].kind +
                       "' cannot be evaluated at its states");
  }
  return problems;
}

/// Of the types that the graph has factors of.
std::vector<CostChange> costs_of(const Graph& graph, const RobustOutcome& outcome) {
  std::vector<CostChange> costs;
  const auto counts = counts_of(graph);
  for (int t = 0; t < kFactorTypes; ++t) {
    const auto k = static_cast<std::size_t>(t);
    if (counts[k] == 0 || k == static_cast<std::size_t>(FactorType::kCustom)) continue;
    costs.push_back({static_cast<FactorType>(t), to_string(static_cast<FactorType>(t)), counts[k],
                     outcome.initial_cost[k], outcome.final_cost[k]});
  }
  return costs;
}

}  // namespace

RefineResult refine(Graph& graph, const RefineOptions& options,
                    const std::function<bool(const RefineProgress&)>& progress) {
  const auto start = std::chrono::steady_clock::now();
  RefineResult result;
  result.problems = graph.problems();
  if (result.problems.empty()) result.problems = not_evaluable(graph);
  if (!result.problems.empty()) {
    result.status = SolveStatus::kInvalidInput;
    return result;
  }
  auto custom_before = custom_costs(graph);
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
  for (const auto& [kind, after] : custom_costs(graph)) {
    result.costs.push_back(
        {FactorType::kCustom, kind, after.factors, custom_before[kind].cost, after.cost});
  }
  result.rank_deficiency = outcome.engine->rank_deficiency();
  for (const KeyframeId id : result.held) graph.at(id).fixed = false;
  graph.marginal_priors = std::move(priors);
  result.solver = outcome.engine->description();
  result.solve_s = seconds_since(start);
  return result;
}

}  // namespace lamina
