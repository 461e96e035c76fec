// Evaluation, checks and the registry of custom factors.
#include <lamina/backend/graph/custom_factor.hpp>

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>

#include <array>
#include <map>
#include <mutex>
#include <utility>

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/graph/states.hpp>
#include <lamina/models/error.hpp>

namespace lamina {
namespace {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct Registry {
  std::mutex mutex;
  std::map<std::string, FactorMaker> makers;
  std::map<std::string, std::shared_ptr<const ceres::Manifold>> manifolds;
};

Registry& registry() {
  static Registry one;
  return one;
}

template <class Values>
auto registered(const Values& values, const std::string& kind, const char* what) {
  const std::lock_guard lock(registry().mutex);
  const auto it = values.find(kind);
  if (it == values.end()) {
    throw Error("graph: found a " + std::string(what) + " of kind '" + kind +
                "', expected a kind that the program registered (register_" + what + ")");
  }
  return it->second;
}

/// Numbers of a state, -1: it is not in the graph.
int numbers_of(const StateRef& state, const Graph& graph) {
  const auto count = [&graph](auto id) {
    const auto* found = graph.find(id);
    if (found == nullptr) return -1;
    if constexpr (std::is_same_v<decltype(id), KeyframeId>) return PoseState::kAmbient;
    if constexpr (std::is_same_v<decltype(id), CustomStateId>) return found->ambient();
  };
  return std::visit(count, state);
}

}  // namespace

int CustomState::tangent() const { return manifold ? manifold->TangentSize() : ambient(); }

void register_factor(const std::string& kind, FactorMaker maker) {
  const std::lock_guard lock(registry().mutex);
  registry().makers[kind] = std::move(maker);
}

void register_manifold(const std::string& kind, std::shared_ptr<const ceres::Manifold> manifold) {
  const std::lock_guard lock(registry().mutex);
  registry().manifolds[kind] = std::move(manifold);
}

CustomFactor make_factor(const std::string& kind, const std::vector<double>& data) {
  CustomFactor factor = registered(registry().makers, kind, "factor")(data);
  factor.kind = kind;
  factor.data = data;
  return factor;
}

std::shared_ptr<const ceres::Manifold> find_manifold(const std::string& kind) {
  return registered(registry().manifolds, kind, "manifold");
}

std::string problem_of(const CustomFactor& factor, const Graph& graph) {
  if (!factor.cost) return "has no cost function";
  const auto& sizes = factor.cost->parameter_block_sizes();
  if (sizes.size() != factor.states.size()) {
    return "names " + std::to_string(factor.states.size()) + " states for a cost function of " +
           std::to_string(sizes.size());
  }
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    const int numbers = numbers_of(factor.states[k], graph);
    if (numbers < 0) return "refers to a missing state";
    if (numbers != sizes[k]) {
      return "has a block of " + std::to_string(sizes[k]) + " numbers for a state of " +
             std::to_string(numbers);
    }
    for (std::size_t other = 0; other < k; ++other) {
      if (factor.states[other] == factor.states[k]) return "reads one state twice";
    }
  }
  return {};
}

std::string problem_of(const CustomState& state) {
  if (state.values.size() == 0) return "has no numbers";
  if (!state.values.allFinite()) return "holds a number that is not finite";
  if (state.manifold && state.manifold->AmbientSize() != state.ambient()) {
    return "has " + std::to_string(state.ambient()) + " numbers on a manifold of " +
           std::to_string(state.manifold->AmbientSize());
  }
  return {};
}

bool evaluate(const CustomFactor& factor, const std::vector<const double*>& blocks, bool jacobians,
              CustomEvaluation& out) {
  const ceres::CostFunction& cost = *factor.cost;
  out.r.resize(cost.num_residuals());
  std::vector<RowMajorMatrix> J;
  std::vector<double*> pointers;
  if (jacobians) {
    for (const int size : cost.parameter_block_sizes()) {
      J.emplace_back(cost.num_residuals(), size);
    }
    for (auto& block : J) pointers.push_back(block.data());
  }
  if (!cost.Evaluate(blocks.data(), out.r.data(), jacobians ? pointers.data() : nullptr) ||
      !out.r.allFinite()) {
    return false;
  }
  out.J.assign(J.begin(), J.end());
  out.chi_squared = out.robust = out.r.squaredNorm();
  out.slope = 1;
  if (factor.loss) {
    std::array<double, 3> rho{};
    factor.loss->Evaluate(out.chi_squared, rho.data());
    out.robust = rho[0];
    out.slope = rho[1];
  }
  return true;
}

bool evaluate_at(const CustomFactor& factor, const Graph& graph, CustomEvaluation& out) {
  std::vector<std::array<double, PoseState::kAmbient>> numbers(factor.states.size());
  std::vector<const double*> blocks;
  for (std::size_t k = 0; k < factor.states.size(); ++k) {
    double* x = numbers[k].data();
    const auto place = [&](auto id) -> const double* {
      const auto& state = graph.at(id);
      if constexpr (std::is_same_v<decltype(id), KeyframeId>) {
        PoseState(state.T_map_body).write(x);
      } else {
        return state.values.data();
      }
      return x;
    };
    blocks.push_back(std::visit(place, factor.states[k]));
  }
  return evaluate(factor, blocks, false, out);
}

Eigen::MatrixXd to_tangent(const CustomState& state, const Eigen::MatrixXd& J_ambient) {
  if (!state.manifold) return J_ambient;
  RowMajorMatrix P(state.ambient(), state.tangent());
  state.manifold->PlusJacobian(state.values.data(), P.data());
  return J_ambient * P;
}

Eigen::VectorXd plus(const CustomState& state, const Eigen::VectorXd& step) {
  if (!state.manifold) return state.values + step;
  Eigen::VectorXd moved(state.ambient());
  state.manifold->Plus(state.values.data(), step.data(), moved.data());
  return moved;
}

}  // namespace lamina
