// Surfels of a window taken out of its equations, as bundle adjustment does its points.
#pragma once

#include <functional>
#include <vector>

#include <lamina/backend/solver/window/marginalization.hpp>
#include <lamina/backend/solver/window/window_state.hpp>

namespace lamina::window {

/// What surfels say of poses and planes: |..|^2 with gradient g = J^T r and H = J^T J, surfels
/// where they fit best. Columns are those of poses, then of planes, of all the state's.
struct SurfelInformation {
  std::vector<int> columns;  ///< of the whole system, ascending
  Eigen::MatrixXd H;         ///< empty where the gradient alone was asked for
  Eigen::VectorXd g;
  double cost = 0;  ///< robust chi-squared
};

/// Moves surfels that `taken` to where they fit best, given poses and planes: three numbers each
/// and, but for the kernel of their parent, a linear problem. The kernel's weight follows. Where
/// the marginal prior has a state, Jacobians are taken where it was frozen.
SurfelInformation eliminate_surfels(State& state, const std::function<bool(const Surfel&)>& taken,
                                    bool gradient_alone);

/// The same as one factor R^T R = H, R^T r = g; variables are poses, then planes. No rows: nothing
/// was taken.
LinearFactor surfel_factor(const SurfelInformation& information, const State& state);

}  // namespace lamina::window
