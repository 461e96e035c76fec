// A solution from where some doubted factors hold.
#pragma once

#include <vector>

#include <lamina/backend/robust.hpp>

namespace lamina {

/// Factors that are believed far beyond their covariance while the others are judged against them:
/// what wrong names have pulled apart by ten sigmas comes back to one, and the names stand out.
struct Believed {
  std::vector<std::size_t> loops;
  std::vector<std::size_t> plane_moments;
};

/// Solves with `believed` at a hundred times their information and sets the weight (0 or 1) of all
/// other plane views and segments, a few rounds; the states and weights are written into the graph,
/// the believed ones weigh 1. Counts its iterations into `outcome`. False: stopped.
bool solve_believing(Graph& graph, const Believed& believed, const RefineOptions& options,
                     RobustOutcome& outcome);

}  // namespace lamina
