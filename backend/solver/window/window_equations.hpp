// A window's factors at their linearisation point: into the equations of a solve, or one by one for
// an elimination.
#pragma once

#include <vector>

#include <lamina/backend/solver/window/marginalization.hpp>
#include <lamina/backend/solver/window/window_state.hpp>
#include <lamina/backend/solver/window/window_system.hpp>

namespace lamina::window {

enum class Build {
  kFirst,      ///< equations with the robust weights from before
  kEquations,  ///< with those of the present states, which are kept
  kGradient    ///< the gradient alone, with those too
};

struct BuiltEquations {
  double cost = 0;           ///< robust chi-squared
  double weight_change = 0;  ///< of a robust weight from that in the equations at hand, the most
};

/// Where the marginal prior has a state, Jacobians are taken where it was frozen. Huber's bound on
/// the chi-squared of a plane view: `robust_chi_squared`.
BuiltEquations build_equations(State& state, double robust_chi_squared, Build what,
                               WindowSystem& system);

/// The factors that touch a state that goes, the prior first; variables are poses, then planes.
std::vector<LinearFactor> linearize_touching(State& state, double robust_chi_squared,
                                             const std::vector<bool>& pose_gone,
                                             const std::vector<bool>& plane_gone);

}  // namespace lamina::window
