// The batch engine by Ceres: the portable twin of the native one.
#pragma once

#include <string>

#include <lamina/backend/solver/ceres/ceres_graph.hpp>

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

class CeresEngine final : public BatchEngine {
 public:
  explicit CeresEngine(const Graph& graph, Parts parts = Parts::kAll);
  CeresEngine(const Graph& graph, Parts parts, SolverChoice choice);

  int dimension() const override { return problem_.dimension(); }
  CostByType cost() const override { return problem_.cost(); }
  RobustWeights chi_squared() const override;
  void set_weights(const RobustWeights& weights) override { problem_.set_weights(weights); }
  MinimizerResult minimize(const MinimizerOptions& options, const IterationCallback& progress = {},
                           const LongPath& path = {}) override;
  bool let_positions_follow() override;
  int rank_deficiency() override;
  void read(const Graph& graph) override { problem_.read(graph); }
  void write(Graph& graph) const override { problem_.write(graph); }
  std::string description() const override;

 private:
  mutable Graph graph_;  // as taken in; its states are those that were last written to it
  SolverChoice choice_;
  CeresGraph problem_;
};

}  // namespace lamina
