// Graduated non-convexity over plane observations, segments and loops [Yang2020].
#pragma once

#include <functional>
#include <vector>

#include <lamina/backend/refiner.hpp>

namespace lamina {

struct RobustOutcome {
  SolveStatus status = SolveStatus::kNothingToSolve;
  int iterations = 0, rounds = 0;
  CostByType initial_cost{}, final_cost{};
  std::vector<FactorRef> rejected;
};

/// Minimises plainly; when every doubtful factor then fits, that is the answer. Otherwise starts
/// again with kernels from nearly quadratic to truncated. Sets `weight` of the graph's factors.
RobustOutcome minimize_robustly(Graph& graph, NormalEquations& equations,
                                const RefineOptions& options,
                                const std::function<bool(const RefineProgress&)>& progress);

}  // namespace lamina
