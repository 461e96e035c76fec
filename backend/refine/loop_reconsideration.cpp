// A second solution, from where every loop holds.
#include <lamina/backend/refine/loop_reconsideration.hpp>

#include <utility>

#include <lamina/backend/refine/pinned_solve.hpp>

namespace lamina {
namespace {

double truncated_cost(const RobustOutcome& outcome, double limit) {
  return total(outcome.final_cost) + cost_of_leaving_out(outcome.rejected, limit);
}

}  // namespace

void reconsider_loops(Graph& graph, const RefineOptions& options,
                      const std::function<bool(const RefineProgress&)>& progress,
                      RobustOutcome& outcome) {
  Pinned reconsidered;
  for (const FactorRef& f : outcome.rejected) {
    if (f.type == FactorType::kLoop) reconsidered.loops.push_back(f.index);
  }
  if (!options.robust || reconsidered.loops.empty() || stopped(outcome.status)) return;
  Graph trial = graph;
  if (!solve_pinned(trial, reconsidered, options, outcome)) return;
  RefineOptions going_on = options;
  going_on.refined_before = true;
  RobustOutcome other = minimize_robustly(trial, going_on, progress);
  outcome.iterations += other.iterations;
  outcome.rounds += other.rounds;
  if (stopped(other.status)) {
    outcome.status = other.status;
    return;
  }
  const double limit = options.inlier_chi2;
  if (!(truncated_cost(other, limit) < truncated_cost(outcome, limit))) return;
  graph = std::move(trial);
  outcome.status = other.status;
  outcome.final_cost = other.final_cost;
  outcome.rejected = std::move(other.rejected);
  outcome.engine = std::move(other.engine);
}

}  // namespace lamina
