// The own solver: block Cholesky of the normal equations, Levenberg-Marquardt.
#pragma once

#include <lamina/backend/solver/native/levenberg_marquardt.hpp>

namespace lamina {

/// Directions that nothing constrains at the present states, by the pivots of the factor.
int rank_deficiency(NormalEquations& equations);

class NativeEngine final : public BatchEngine {
 public:
  explicit NativeEngine(const Graph& graph, Parts parts = Parts::kAll) : equations_(graph, parts) {}

  int dimension() const override { return equations_.dimension(); }
  CostByType cost() const override { return equations_.cost(); }
  RobustWeights chi_squared() const override { return equations_.chi_squared(); }
  void set_weights(const RobustWeights& weights) override { equations_.set_weights(weights); }
  MinimizerResult minimize(const MinimizerOptions& options, const IterationCallback& progress = {},
                           const LongPath& path = {}) override {
    return lamina::minimize(equations_, options, progress, path);
  }
  bool let_positions_follow() override;
  int rank_deficiency() override;
  void read(const Graph& graph) override { equations_.read(graph); }
  void write(Graph& graph) const override { equations_.write(graph); }
  std::string description() const override {
    return "block Cholesky of the normal equations (CHOLMOD), minimum degree on blocks";
  }

 private:
  NormalEquations equations_;
};

}  // namespace lamina
