// Graduated non-convexity over plane observations, segments and loops [Yang2020].
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include <lamina/backend/refine/refiner.hpp>

namespace lamina {

struct RobustOutcome {
  SolveStatus status = SolveStatus::kNothingToSolve;
  int iterations = 0, rounds = 0;
  CostByType initial_cost{}, final_cost{};
  std::vector<FactorRef> rejected;
  std::unique_ptr<BatchEngine> engine;  ///< of the last solve, at the solution
};

/// Whether there is nothing to go on with after a solve that ended so.
inline bool stopped(SolveStatus status) {
  return status == SolveStatus::kCancelled || status == SolveStatus::kInvalidInput ||
         status == SolveStatus::kNothingToSolve;
}

/// Minimises plainly with the factors that were not rejected before; when every doubtful factor
/// then fits, that is the answer. Otherwise, or when observations contradict each other from the
/// outset, believes all again and starts with kernels from nearly quadratic to truncated. The last
/// solve is one of fixed sets, and the status is its own. Writes the states and the `weight` of
/// doubtful factors (0 or 1) into the graph.
RobustOutcome minimize_robustly(Graph& graph, const RefineOptions& options,
                                const std::function<bool(const RefineProgress&)>& progress);

}  // namespace lamina
