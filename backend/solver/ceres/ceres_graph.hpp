// The graph as a ceres::Problem: the portable twin of NormalEquations, and what other tools build
// on.
#pragma once

#include <memory>
#include <string>

#include <lamina/backend/solver/native/levenberg_marquardt.hpp>

namespace ceres {
class Problem;
}

namespace lamina {

/// How a graph's linear systems are solved, and why.
struct SolverChoice {
  enum class Kind {
    kNormalCholesky,  ///< SPARSE_NORMAL_CHOLESKY, SuiteSparse: long chains of poses
    kSchur            ///< SPARSE_SCHUR, SuiteSparse: few poses that see many planes or surfels each
  };
  Kind kind = Kind::kNormalCholesky;
  bool eliminate_surfels = false;  ///< kSchur: the first group is surfels, else planes
  std::string why;
};
/// By shape: measured on chains, eliminating planes is 15-20 times slower; on dense batches it is
/// 60 times faster.
SolverChoice choose_solver(const Graph& graph);

/// Owns the parameter blocks and the problem. Held states are constant blocks; factors carry their
/// weight; surfel parents a Cauchy kernel.
class CeresGraph {
 public:
  explicit CeresGraph(const Graph& graph);
  ~CeresGraph();
  CeresGraph(const CeresGraph&) = delete;
  CeresGraph& operator=(const CeresGraph&) = delete;

  ceres::Problem& problem();
  /// Solves with one thread, the trust region and stopping rule of `options`.
  MinimizerResult solve(const MinimizerOptions& options, const SolverChoice& choice);
  void write(Graph& graph) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lamina
