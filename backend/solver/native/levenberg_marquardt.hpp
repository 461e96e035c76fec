// Levenberg-Marquardt on the assembled graph.
#pragma once

#include <functional>
#include <limits>

#include <lamina/backend/solver/native/normal_equations.hpp>

namespace lamina {

enum class SolveStatus {
  kConverged,       ///< the last step changed chi-squared by less than the tolerance
  kMaxIterations,   ///< stopped before that
  kStalled,         ///< no step lowers the cost, though the gradient says one should
  kCancelled,       ///< the progress callback said stop
  kNothingToSolve,  ///< no free state, or no factor
  kInvalidInput     ///< Graph::problems() is not empty; nothing was changed
};
const char* to_string(SolveStatus status);

struct MinimizerOptions {
  int max_iterations = 50;  ///< linear systems solved
  int max_steps = 1000;     ///< of them, steps that lowered the cost
  /// Stop when a step is predicted to lower chi-squared by less: absolute, because the cost's size
  /// says nothing about how far the states are from their best. 1e-2 is 0.1 sigma in all, and that
  /// last step is still taken.
  double chi2_tolerance = 1e-2;
  /// The same relative to chi-squared, whichever is larger. A step's predicted decrease is its
  /// length in sigmas, squared; a good solution's chi-squared is the number of its redundant
  /// measurements. So 1e-6 is a step of a thousandth of a sigma for each of them.
  double relative_tolerance = 1e-6;
  /// Relative to the diagonal. So small that a step is Gauss-Newton's wherever the graph is
  /// determined, and directions that nothing constrains still stay put.
  double initial_damping = 1e-14;
  double max_damping = 1e4;
  /// Stop (kStalled) after so many steps that raised the cost, all told.
  int max_rejections = 1000;
};

/// For paths so long that they may be off by radians.
struct LongPath {
  /// Stop before the first step (turns_too_far) when it would turn a keyframe by more, rad.
  double largest_first_turn = std::numeric_limits<double>::infinity();
  /// After a step that turns a keyframe by more than this (rad) and lowers the cost by little of
  /// what it promised: let_positions_follow(). Turns of hundredths bend no path.
  double follow_from_turn = std::numeric_limits<double>::infinity();
};

struct Iteration {
  int number = 0;  ///< from 1
  double cost = 0;
  double predicted_decrease = 0;
  double damping = 0;
  bool accepted = false;
  double largest_turn = 0;  ///< of a keyframe by the step, rad
};

struct MinimizerResult {
  SolveStatus status = SolveStatus::kNothingToSolve;
  int iterations = 0;          ///< linear systems solved
  bool turns_too_far = false;  ///< see LongPath; the states are as they were
  CostByType initial_cost{}, final_cost{};
};

double total(const CostByType& cost);

/// Turns stay as they are, positions and distances go where they fit best: a linear problem, solved
/// by one system at the states of the last linearize(). A step that turns a long path moves its
/// positions along tangents; that stretches every link by half the square of the turn, and the cost
/// goes up although the turns are right. False when the system could not be solved. `further` as
/// in NormalEquations::step().
bool let_positions_follow(NormalEquations& equations, double damping, bool further);

/// Moves the states of `equations` to the nearest minimum. `progress` is called after each
/// iteration; returning false stops. Never throws for numerical reasons, never leaves NaN behind.
MinimizerResult minimize(NormalEquations& equations, const MinimizerOptions& options,
                         const std::function<bool(const Iteration&)>& progress = {},
                         const LongPath& path = {});

}  // namespace lamina
