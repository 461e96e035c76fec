// The bordered system, by the graph's own normal equations.
#include <lamina/backend/shared_errors.hpp>

#include <Eigen/Cholesky>
#include <algorithm>

#include <lamina/backend/normal_equations.hpp>

namespace lamina {
namespace {

constexpr double kDamping = 1e-9;  // relative: directions that nothing tells stay put

Eigen::VectorXd gradient_of(const Graph& graph) {
  NormalEquations equations(graph);
  equations.linearize();
  return equations.gradient();
}

}  // namespace

std::optional<SharedErrors> estimate_shared_errors(const Graph& graph,
                                                   const SharedErrorModel& model) {
  NormalEquations equations(graph);
  if (equations.dimension() == 0) return std::nullopt;
  equations.linearize();
  Eigen::VectorXd damping = kDamping * equations.diagonal();
  for (double& d : damping) d = std::max(d, 1e-12);
  if (!equations.factorize(damping)) return std::nullopt;

  const Eigen::Index count = model.g.size();
  Eigen::MatrixXd B(equations.dimension(), count), H_inverse_B(equations.dimension(), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::VectorXd d = model.delta * Eigen::VectorXd::Unit(count, k);
    B.col(k) = (gradient_of(model.corrected(graph, d)) - gradient_of(model.corrected(graph, -d))) /
               (2 * model.delta);
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

}  // namespace lamina
