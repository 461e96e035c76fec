// Levenberg-Marquardt on the assembled graph.
#pragma once

#include <functional>

#include <lamina/backend/normal_equations.hpp>

namespace lamina {

enum class SolveStatus {
  kConverged,       ///< the next step would change chi-squared by less than the tolerance
  kMaxIterations,   ///< stopped before that
  kStalled,         ///< no step lowers the cost, though the gradient says one should
  kCancelled,       ///< the progress callback said stop
  kNothingToSolve,  ///< no free state, or no factor
  kInvalidInput     ///< Graph::problems() is not empty; nothing was changed
};
const char* to_string(SolveStatus status);

struct MinimizerOptions {
  int max_iterations = 50;
  /// Stop when a step is predicted to lower chi-squared by less: absolute, because the cost's size
  /// says nothing about how far the states are from their best. 1e-2 is 0.1 sigma in all, and that
  /// last step is still taken.
  double chi2_tolerance = 1e-2;
  /// Relative to the diagonal. So small that a step is Gauss-Newton's wherever the graph is
  /// determined, and directions that nothing constrains still stay put.
  double initial_damping = 1e-14;
  double max_damping = 1e4;
};

struct Iteration {
  int number = 0;  ///< from 1
  double cost = 0;
  double predicted_decrease = 0;
  double damping = 0;
  bool accepted = false;
};

struct MinimizerResult {
  SolveStatus status = SolveStatus::kNothingToSolve;
  int iterations = 0;  ///< linear systems solved
  CostByType initial_cost{}, final_cost{};
};

double total(const CostByType& cost);

/// Moves the states of `equations` to the nearest minimum. `progress` is called after each
/// iteration; returning false stops. Never throws for numerical reasons, never leaves NaN behind.
MinimizerResult minimize(NormalEquations& equations, const MinimizerOptions& options,
                         const std::function<bool(const Iteration&)>& progress = {});

}  // namespace lamina
