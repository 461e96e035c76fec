// Factors and states of a user's own in the graph: Ceres cost functions, by either engine.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include <lamina/backend/graph/ids.hpp>

namespace ceres {
class CostFunction;
class LossFunction;
class Manifold;
}  // namespace ceres

namespace lamina {

struct Graph;

/// Numbers of a user's own that are estimated: the place of a beacon, the bias of a sensor.
struct CustomState {
  CustomStateId id = CustomStateId::kNone;
  Eigen::VectorXd values;                           ///< as the cost functions read them
  std::shared_ptr<const ceres::Manifold> manifold;  ///< null: each number for itself
  bool fixed = false;                               ///< held by every solver
  std::string kind;  ///< of its manifold, for archives: register_manifold()

  int ambient() const { return static_cast<int>(values.size()); }
  int tangent() const;
};

/// A state that a custom factor reads. Parameter blocks (backend/graph/states.hpp): a keyframe 7
/// (T_map_body: translation, quaternion x y z w), a custom state its values. (Planes are merged,
/// split and anchored anew on the way: what they are is the mapper's to say.)
using StateRef = std::variant<KeyframeId, CustomStateId>;

struct CustomFactor {
  /// Its name in reports and outliers; an archive makes it anew by the maker registered for it.
  std::string kind;
  std::vector<StateRef> states;               ///< the blocks of `cost`, in its order
  std::shared_ptr<ceres::CostFunction> cost;  ///< whitened residuals
  std::shared_ptr<ceres::LossFunction> loss;  ///< null: the square
  bool may_be_wrong = false;                  ///< the refiner may leave it out
  std::vector<double> data;                   ///< what its maker makes `cost` and `loss` from
  double weight = 1;                          ///< as the last refinement left it; 0: left out
};

/// What an archive holds of a factor is kind, states and data; the maker gives cost and loss again.
using FactorMaker = std::function<CustomFactor(const std::vector<double>& data)>;
/// For all graphs of the process. A second maker of a kind replaces the first.
void register_factor(const std::string& kind, FactorMaker maker);
void register_manifold(const std::string& kind, std::shared_ptr<const ceres::Manifold> manifold);
/// Throws lamina::Error for a kind that nobody registered, naming it.
CustomFactor make_factor(const std::string& kind, const std::vector<double>& data);
std::shared_ptr<const ceres::Manifold> find_manifold(const std::string& kind);

/// What is wrong with a factor in this graph, or with a state; empty: nothing.
std::string problem_of(const CustomFactor& factor, const Graph& graph);
std::string problem_of(const CustomState& state);

/// A custom factor at given values of its blocks.
struct CustomEvaluation {
  Eigen::VectorXd r;               ///< whitened, without loss and weight
  std::vector<Eigen::MatrixXd> J;  ///< by block, to its numbers; when asked for
  double chi_squared = 0;          ///< |r|^2
  double robust = 0, slope = 1;    ///< of the loss: its value and derivative at chi_squared
  /// chi_squared as of three residuals, which is what the refiner's limit is for.
  double chi_squared_of_three() const {
    return chi_squared * 3 / static_cast<double>(std::max<Eigen::Index>(3, r.size()));
  }
};
/// False where the cost function says it cannot be evaluated there.
bool evaluate(const CustomFactor& factor, const std::vector<const double*>& blocks, bool jacobians,
              CustomEvaluation& out);
/// The same at the graph's states.
bool evaluate_at(const CustomFactor& factor, const Graph& graph, CustomEvaluation& out);

/// Jacobian to the tangent of a custom state, and a step in it.
Eigen::MatrixXd to_tangent(const CustomState& state, const Eigen::MatrixXd& J_ambient);
Eigen::VectorXd plus(const CustomState& state, const Eigen::VectorXd& step);

}  // namespace lamina
