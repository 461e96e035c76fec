// Errors that many factors of a graph share, as states beside its poses and planes.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

/// A graph whose factors some errors e change, linearised in these at e = 0.
struct SharedErrorModel {
  /// The graph with its factors as they would be, were they corrected by e.
  std::function<Graph(const Graph&, const Eigen::VectorXd& e)> corrected;
  Eigen::MatrixXd C;  ///< j^T j of the whitened residuals, states held, and the prior's information
  Eigen::VectorXd g;  ///< likewise j^T r
  double delta = 1e-4;  ///< of an error, for differences
};

struct SharedErrors {
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;
};

/// One Gauss-Newton step of a refined graph with the errors as states:
///   [H  B] [dx]     [J^T r]
///   [B' C] [de] = - [g    ]     solved for de with x eliminated,
/// B by central differences of the gradient. nullopt where the system cannot be solved.
std::optional<SharedErrors> estimate_shared_errors(const Graph& graph,
                                                   const SharedErrorModel& model);

/// The graph as it would be, each of the `count` errors `delta` by itself, by one Gauss-Newton
/// step: dx = -H^-1 B e. Empty where the system cannot be solved.
std::vector<Graph> moved_by_errors(
    const Graph& graph,
    const std::function<Graph(const Graph&, const Eigen::VectorXd& e)>& corrected, int count,
    double delta);

}  // namespace lamina
