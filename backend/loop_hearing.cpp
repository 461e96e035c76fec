// A second solution, from where every loop holds.
#include <lamina/backend/loop_hearing.hpp>

#include <utility>

#include <lamina/backend/believing.hpp>

namespace lamina {
namespace {

double truncated_cost(const RobustOutcome& outcome, double limit) {
  return total(outcome.final_cost) + cost_of_leaving_out(outcome.rejected, limit);
}

}  // namespace

void hear_loops_together(Graph& graph, const RefineOptions& options,
                         const std::function<bool(const RefineProgress&)>& progress,
                         RobustOutcome& outcome) {
  Believed heard;
  for (const FactorRef& f : outcome.rejected) {
    if (f.type == FactorType::kLoop) heard.loops.push_back(f.index);
  }
  if (!options.robust || heard.loops.empty() || stopped(outcome.status)) return;
  Graph trial = graph;
  if (!solve_believing(trial, heard, options, outcome)) return;
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
  outcome.equations = std::move(other.equations);
}

}  // namespace lamina
