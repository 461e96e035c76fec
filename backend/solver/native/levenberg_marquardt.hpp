// Levenberg-Marquardt on the assembled graph.
#pragma once

#include <lamina/backend/solver/native/normal_equations.hpp>

namespace lamina {

/// Turns stay as they are, positions and distances go where they fit best: a linear problem, solved
/// by one system at the states of the last linearize(). A step that turns a long path moves its
/// positions along tangents; that stretches every link by half the square of the turn, and the cost
/// goes up although the turns are right. False when the system could not be solved. `further` as
/// in NormalEquations::step().
bool let_positions_follow(NormalEquations& equations, double damping, bool further);

/// Moves the states of `equations` to the nearest minimum. `progress` is called after each
/// iteration; returning false stops. Never throws for numerical reasons, never leaves NaN behind.
MinimizerResult minimize(NormalEquations& equations, const MinimizerOptions& options,
                         const IterationCallback& progress = {}, const LongPath& path = {});

}  // namespace lamina
