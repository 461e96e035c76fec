// A user's factors among the own solver's terms: Ceres cost functions, lifted to the tangents.
#include <lamina/backend/solver/native/normal_equations_impl.hpp>

#include <array>
#include <cmath>
#include <limits>

#include <lamina/backend/solver/ceres/lift.hpp>

namespace lamina {

using namespace detail;

void NormalEquations::Impl::make_custom(const Graph& graph) {
  custom_count = graph.custom.size();
  for (const CustomState& state : graph.custom_states) {
    own_now.push_back(state);
    const bool held = state.fixed || states.turns_only;
    own_variable.push_back(held ? kHeld : static_cast<int>(sizes.size()));
    if (!held) sizes.push_back(state.tangent());
  }
  own_before = own_now;
  if (states.turns_only) return;  // what they say of turns alone is not known
  for (std::size_t i = 0; i < graph.custom.size(); ++i) {
    if (!(graph.custom[i].weight > 0)) continue;
    Custom custom{graph.custom[i], {}, {}, i};
    for (const StateRef& ref : custom.factor.states) {
      std::array<int, 2> at = {kHeld, kHeld};  // of the kinds that it is not
      std::visit(
          [&](auto id) {
            if constexpr (std::is_same_v<decltype(id), KeyframeId>) {
              at[0] = static_cast<int>(&graph.at(id) - graph.keyframes.data());
            } else {
              at[1] = static_cast<int>(&graph.at(id) - graph.custom_states.data());
            }
          },
          ref);
      custom.poses.push_back(at[0]);
      custom.own.push_back(at[1]);
    }
    customs.push_back(std::move(custom));
  }
}

std::vector<int> NormalEquations::Impl::variables(const Custom& custom) const {
  std::vector<int> v;
  for (std::size_t k = 0; k < custom.own.size(); ++k) {
    const auto pick = [&v](int at, const std::vector<int>& variable) {
      if (at >= 0) v.push_back(variable[static_cast<std::size_t>(at)]);
    };
    pick(custom.poses[k], states.poses.variable);
    pick(custom.own[k], own_variable);
  }
  return v;
}

bool NormalEquations::Impl::evaluate_blocks(const Custom& custom, bool jacobians,
                                            CustomEvaluation& out) const {
  const std::size_t count = custom.own.size();
  std::vector<std::array<double, PoseState::kAmbient>> numbers(count);
  std::vector<const double*> blocks(count);
  for (std::size_t k = 0; k < count; ++k) {
    blocks[k] = numbers[k].data();
    if (custom.poses[k] >= 0) {
      states.poses.now[static_cast<std::size_t>(custom.poses[k])].write(numbers[k].data());
    } else {
      blocks[k] = own_now[static_cast<std::size_t>(custom.own[k])].values.data();
    }
  }
  if (!lamina::evaluate(custom.factor, blocks, jacobians, out)) return false;
  for (std::size_t k = 0; jacobians && k < count; ++k) {
    if (custom.poses[k] >= 0) {
      const auto at = static_cast<std::size_t>(custom.poses[k]);
      out.J[k] = lamina::to_tangent(states.poses.now[at], blocks[k], out.J[k]);
    } else {
      out.J[k] = lamina::to_tangent(own_now[static_cast<std::size_t>(custom.own[k])], out.J[k]);
    }
  }
  return true;
}

double NormalEquations::Impl::evaluate(const Custom& custom, Eigen::VectorXd* out) const {
  CustomEvaluation e;
  // A step to where it cannot be evaluated is not taken.
  if (!evaluate_blocks(custom, out != nullptr, e)) return std::numeric_limits<double>::infinity();
  const double weight = custom.factor.weight;
  if (out == nullptr) return weight * e.robust;
  const double w = weight * std::max(0.0, e.slope);
  const std::vector<int> v = variables(custom);
  for (std::size_t a = 0; a < v.size(); ++a) {
    if (v[a] == kHeld) continue;
    out->segment(matrix->row_of(v[a]), e.J[a].cols()) += w * e.J[a].transpose() * e.r;
    for (std::size_t b = a; b < v.size(); ++b) {
      if (v[b] == kHeld) continue;
      matrix->slot(v[a], v[b]).add_block(w * e.J[a].transpose() * e.J[b]);
    }
  }
  return weight * e.robust;
}

}  // namespace lamina
