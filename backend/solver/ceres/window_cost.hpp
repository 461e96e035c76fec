// Parameter blocks of a window's states, and terms of the graph as costs over them. Internal to
// ceres_window.cpp.
#pragma once

#include <ceres/ceres.h>

#include <array>
#include <tuple>
#include <type_traits>
#include <utility>

#include <lamina/backend/solver/ceres/lift.hpp>
#include <lamina/backend/solver/window/window_state.hpp>

namespace lamina::window {

/// A parameter block, and where its Jacobians are taken.
struct PoseBlock {
  using State = PoseState;
  std::array<double, 7> x{};
  PoseState first;
  bool frozen = false;

  void take(const Pose& pose) {
    pose.now.write(x.data());
    first = pose.first;
    frozen = pose.frozen;
  }
  PoseState at(const double* values) const { return PoseState(values); }
  /// Where Jacobians are taken when the state is `now`.
  const PoseState& linear(const PoseState& now) const { return frozen ? first : now; }
};

struct PlaneBlock {
  using State = PlaneState;
  std::array<double, 4> x{};
  PlaneState start, first;
  bool frozen = false;

  void take(const Landmark& plane) {
    plane.now.write(x.data());
    start = plane.now;
    first = plane.first;
    frozen = plane.frozen;
  }
  /// With the basis of the start carried along.
  PlaneState at(const double* values) const {
    return start.carried(PlaneState(values).minus(start));
  }
  const PlaneState& linear(const PlaneState& now) const { return frozen ? first : now; }
};

/// A surfel's block; what carries it is the map, which is no variable.
struct SurfelBlock {
  using State = FlatState;
  std::array<double, 3> x{};

  FlatState at(const double* values) const { return FlatState(values); }
  const FlatState& linear(const FlatState& now) const { return now; }
};

/// SurfelMomentsTerm and SurfelParentTerm of what the map carries: without the carrier.
template <class Term, class Seen>
struct OnMap {
  enum : int { kResiduals = Term::kResiduals };
  using Jacobians = TermJacobians<kResiduals, Seen, FlatState>;
  using Residual = Eigen::Matrix<double, kResiduals, 1>;
  Term term;

  void evaluate(const Seen& seen, const FlatState& surfel, Residual& r, Jacobians* J) const {
    static const PoseState map;
    typename Term::Jacobians all;
    if constexpr (std::is_same_v<Seen, PoseState>) {
      term.evaluate(seen, map, surfel, r, J != nullptr ? &all : nullptr);
      if (J != nullptr) std::get<0>(*J) = std::get<0>(all);
    } else {
      term.evaluate(map, seen, surfel, r, J != nullptr ? &all : nullptr);
      if (J != nullptr) std::get<0>(*J) = std::get<1>(all);
    }
    if (J != nullptr) std::get<1>(*J) = std::get<2>(all);
  }
};

/// A term of states, first estimates where they are frozen.
template <class Term, class... Blocks>
class WindowCost final
    : public ceres::SizedCostFunction<Term::kResiduals, Blocks::State::kAmbient...> {
 public:
  WindowCost(const Term& term, const Blocks&... blocks) : term_(term), blocks_(&blocks...) {}
  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    return evaluate(x, residuals, jacobians, std::index_sequence_for<Blocks...>());
  }

 private:
  template <std::size_t... I>
  bool evaluate(const double* const* x, double* residuals, double** jacobians,
                std::index_sequence<I...>) const {
    using Residual = Eigen::Matrix<double, Term::kResiduals, 1>;
    const std::tuple<typename Blocks::State...> now{std::get<I>(blocks_)->at(x[I])...};
    Residual r;
    term_.evaluate(std::get<I>(now)..., r, nullptr);
    Residual::Map(residuals) = r;
    if (jacobians == nullptr) return true;
    Residual r_first;
    typename Term::Jacobians J;
    term_.evaluate(std::get<I>(blocks_)->linear(std::get<I>(now))..., r_first, &J);
    const auto one = [&](auto index) {
      constexpr std::size_t k = decltype(index)::value;
      if (jacobians[k] != nullptr) lift(std::get<k>(now), x[k], std::get<k>(J), jacobians[k]);
    };
    (one(std::integral_constant<std::size_t, I>()), ...);
    return true;
  }

  Term term_;
  std::tuple<const Blocks*...> blocks_;
};

}  // namespace lamina::window
