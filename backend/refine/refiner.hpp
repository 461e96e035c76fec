// The whole graph at once, robustly: offline, or after a loop closed.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/refine/plane_refit.hpp>
#include <lamina/backend/solver/engine.hpp>

namespace lamina {

struct RefineOptions {
  SolverEngine engine = SolverEngine::kNative;
  MinimizerOptions minimizer;
  /// Doubt plane observations and loops: graduated non-convexity. Off: all are believed.
  bool robust = true;
  /// Start planes from all their evidence at the present poses instead of their present estimates.
  bool planes_from_evidence = false;
  /// Chi-squared per degree of freedom above which an observation counts as wrong: 99.9 % of 3
  /// degrees is 16.3; residual model errors ask for more.
  double inlier_chi2 = 25;
  int max_rounds = 20;  ///< of graduated non-convexity
  /// Keyframes from which turns alone are asked first whether the path must be unwound, rather than
  /// the whole system: theirs is a third of it. The result is the same.
  std::size_t turns_first = 15000;
  /// The graph was refined before and few things changed since: factors are judged in or out from
  /// the solution there is, without a fresh start.
  bool refined_before = false;
  /// The mapper merges planes until no more is to be merged; false, where a robot waits: once.
  bool thorough = true;
  /// Indices of plane views that are believed beyond their covariance at first, while the others
  /// are judged against them; then all are judged as ever, from where that leads.
  std::vector<std::size_t> pinned_views;
};

struct CostChange {
  FactorType type = FactorType::kOdometry;
  std::string name;  ///< of the type; of a user's factors their kind
  std::size_t factors = 0;
  double before = 0, after = 0;  ///< sum of squared whitened residuals
};

struct RefineProgress {
  int round = 0;      ///< of graduated non-convexity, from 0
  int iteration = 0;  ///< over all rounds, from 1
  double cost = 0;
  double predicted_decrease = 0;
};

struct RefineResult {
  SolveStatus status = SolveStatus::kNothingToSolve;
  int iterations = 0;  ///< linear systems solved, over all rounds
  int rounds = 0;      ///< of graduated non-convexity; 0: the plain problem was consistent
  double solve_s = 0;  ///< wall time of everything refine() did
  std::vector<CostChange> costs;      ///< of types that occur
  std::vector<FactorRef> rejected;    ///< factors found wrong: weight below one half
  std::vector<KeyframeId> held;       ///< held because their part of the graph had no other datum
  int rank_deficiency = 0;            ///< directions that nothing constrains, beyond what is held
  std::string solver;                 ///< which linear solver, and why
  std::vector<std::string> problems;  ///< Graph::problems() when the status is kInvalidInput
};

/// Refines every free state of the graph in place and sets `weight` of doubtful factors. Never
/// throws for numerical reasons, never leaves NaN behind. `progress` returning false stops early.
RefineResult refine(Graph& graph, const RefineOptions& options = {},
                    const std::function<bool(const RefineProgress&)>& progress = {});

}  // namespace lamina
