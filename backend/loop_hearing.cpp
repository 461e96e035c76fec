// A second solution, from where every loop holds.
#include <lamina/backend/loop_hearing.hpp>

#include <algorithm>
#include <utility>

#include <lamina/backend/normal_equations.hpp>
#include <lamina/backend/plane_refit.hpp>

namespace lamina {
namespace {

/// Times a loop's square-root information while views are judged against it: what a wrong name
/// has pulled apart by ten of its sigmas comes back to one, and the name stands out.
constexpr double kBelief = 10;
constexpr int kMostRounds = 5;
constexpr double kSlack = 1.25;  // as in settling: views at the limit do not flip

double truncated_cost(const RobustOutcome& outcome, double limit) {
  return total(outcome.final_cost) + limit * static_cast<double>(outcome.rejected.size());
}

bool stopped(SolveStatus status) {
  return status == SolveStatus::kCancelled || status == SolveStatus::kInvalidInput ||
         status == SolveStatus::kNothingToSolve;
}

/// In or out for each view; how many changed.
template <class Factors>
std::size_t judge(Factors& factors, const std::vector<double>& chi2, double limit) {
  std::size_t changed = 0;
  for (std::size_t i = 0; i < factors.size(); ++i) {
    const bool was = factors[i].weight >= 0.5;
    const bool is = chi2[i] <= limit * (was ? kSlack : 1 / kSlack);
    changed += is == was ? 0 : 1;
    factors[i].weight = is ? 1 : 0;
  }
  return changed;
}

/// Solves with all loops as they are, views judged against them. False: stopped.
bool solve_believing(Graph& graph, const RefineOptions& options, RobustOutcome& outcome) {
  MinimizerOptions few_steps = options.minimizer;
  few_steps.initial_damping = std::max(1e-10, few_steps.initial_damping);
  few_steps.max_steps = 3;
  for (int round = 0; round < kMostRounds; ++round) {
    {
      NormalEquations equations(graph);
      const MinimizerResult result = minimize(equations, few_steps);
      outcome.iterations += result.iterations;
      if (stopped(result.status)) return false;
      equations.write(graph);
    }
    const RobustWeights chi2 = chi_squared_of(graph);
    const std::size_t changed =
        judge(graph.plane_moments, chi2.plane_moments, options.inlier_chi2) +
        judge(graph.segments, chi2.segments, options.inlier_chi2);
    if (changed == 0) break;
    fit_planes_to_evidence(graph);
  }
  return true;
}

}  // namespace

void hear_loops_together(Graph& graph, const RefineOptions& options,
                         const std::function<bool(const RefineProgress&)>& progress,
                         RobustOutcome& outcome) {
  std::vector<std::size_t> heard;
  for (const FactorRef& f : outcome.rejected) {
    if (f.type == FactorType::kLoop) heard.push_back(f.index);
  }
  if (!options.robust || heard.empty() || stopped(outcome.status)) return;
  Graph trial = graph;
  for (const std::size_t i : heard) {
    trial.loops[i].weight = 1;
    trial.loops[i].sqrt_information *= kBelief;
  }
  if (!solve_believing(trial, options, outcome)) return;
  for (const std::size_t i : heard) {
    trial.loops[i].sqrt_information = graph.loops[i].sqrt_information;
  }
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
