// A solution from where some doubted factors hold.
#pragma once

#include <vector>

#include <lamina/backend/refine/graduated_non_convexity.hpp>

namespace lamina {

/// `limit` for each view left out, four times that for each loop: a name given wrongly comes back
/// in many views, while each loop was found, refined and voted for on its own. (On freiburg_079 and
/// variants of it, right loops lost to views at equal weight.)
double cost_of_leaving_out(const std::vector<FactorRef>& rejected, double limit);

/// Factors that are believed far beyond their covariance while the others are judged against them:
/// what wrong names have pulled apart by ten sigmas comes back to one, and the names stand out.
struct Pinned {
  std::vector<std::size_t> loops;
  std::vector<std::size_t> plane_moments;
};

/// Solves with `believed` at a hundred times their information and sets the weight (0 or 1) of all
/// other plane views and segments, a few rounds; the states and weights are written into the graph,
/// the believed ones weigh 1. Counts its iterations into `outcome`. False: stopped.
bool solve_pinned(Graph& graph, const Pinned& accepted, const RefineOptions& options,
                  RobustOutcome& outcome);

}  // namespace lamina
