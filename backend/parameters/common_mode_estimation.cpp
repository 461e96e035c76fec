// The bordered system, by the graph's own normal equations.
#include <lamina/backend/parameters/common_mode_estimation.hpp>

#include <Eigen/Cholesky>
#include <algorithm>

#include <lamina/backend/graph/datum.hpp>
#include <lamina/backend/refine/refiner.hpp>
#include <lamina/backend/solver/native/normal_equations.hpp>

namespace lamina {
namespace {

constexpr double kDamping = 1e-9;  // relative: directions that nothing tells stay put

Eigen::VectorXd gradient_of(const Graph& graph) {
  NormalEquations equations(graph);
  equations.linearize();
  return equations.gradient();
}

bool factorize(NormalEquations& equations) {
  equations.linearize();
  Eigen::VectorXd damping = kDamping * equations.diagonal();
  for (double& d : damping) d = std::max(d, 1e-12);
  return equations.factorize(damping);
}

// A column of B: how the gradient changes with error k.
Eigen::VectorXd by_error(
    const Graph& graph, const std::function<Graph(const Graph&, const Eigen::VectorXd&)>& corrected,
    Eigen::Index k, Eigen::Index count, double delta) {
  const Eigen::VectorXd d = delta * Eigen::VectorXd::Unit(count, k);
  return (gradient_of(corrected(graph, d)) - gradient_of(corrected(graph, -d))) / (2 * delta);
}

}  // namespace

std::optional<SharedErrors> estimate_shared_errors(const Graph& graph,
                                                   const SharedErrorModel& model) {
  NormalEquations equations(graph);
  if (equations.dimension() == 0 || !factorize(equations)) return std::nullopt;

  const Eigen::Index count = model.g.size();
  Eigen::MatrixXd B(equations.dimension(), count), H_inverse_B(equations.dimension(), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    B.col(k) = by_error(graph, model.corrected, k, count, model.delta);
    H_inverse_B.col(k) = equations.solve(B.col(k));
  }
  const Eigen::MatrixXd S = model.C - B.transpose() * H_inverse_B;
  const Eigen::LLT<Eigen::MatrixXd> llt(0.5 * (S + S.transpose()));
  if (llt.info() != Eigen::Success) return std::nullopt;
  SharedErrors result;
  result.value = -llt.solve(model.g - H_inverse_B.transpose() * equations.gradient());
  result.covariance = llt.solve(Eigen::MatrixXd::Identity(count, count));
  if (!result.value.allFinite() || !result.covariance.allFinite()) return std::nullopt;
  return result;
}

std::vector<Graph> moved_by_errors(
    const Graph& graph,
    const std::function<Graph(const Graph&, const Eigen::VectorXd& e)>& corrected, int count,
    double delta) {
  Graph held = graph;
  for (const KeyframeId id : keyframes_without_datum(graph)) held.at(id).fixed = true;
  std::vector<Graph> moved;
  NormalEquations equations(held);
  if (equations.dimension() == 0 || !factorize(equations)) return moved;
  for (int k = 0; k < count; ++k) {
    const Eigen::VectorXd B = by_error(held, corrected, k, count, delta);
    equations.step(-delta * equations.solve(B));
    equations.write(moved.emplace_back(graph));
    equations.undo_step();
  }
  return moved;
}

}  // namespace lamina
