// Terms of one type in one array, evaluated and scattered into the block Cholesky's matrix without
// a virtual call or a copy. Internal to normal_equations.cpp.
#pragma once

#include <array>
#include <cmath>
#include <type_traits>
#include <utility>
#include <vector>

#include <lamina/backend/graph/factors/surfel_parent.hpp>
#include <lamina/backend/graph/states.hpp>
#include <lamina/backend/solver/native/block_cholesky.hpp>

namespace lamina::detail {

constexpr int kHeld = -1;  ///< variable index of a state no solver moves

template <class State>
struct States {
  std::vector<State> now, before;
  std::vector<int> variable;  ///< kHeld or the column block
};

struct AllStates {
  States<PoseState> poses;
  States<PlaneState> planes;
  States<FlatState> surfels;
  States<PoseState> extrinsics;
  /// Only the columns that turn something are variables; where anything is stays as it is.
  bool turns_only = false;
};

/// Which columns of a state's tangent turn it. Surfels and sensors are held where turns alone are
/// asked for.
template <class State>
struct TurningColumns;
template <>
struct TurningColumns<PoseState> {
  static constexpr int kFirst = 3, kCount = 3;
};
template <>
struct TurningColumns<PlaneState> {
  static constexpr int kFirst = 0, kCount = 2;
};
template <>
struct TurningColumns<FlatState> {
  static constexpr int kFirst = 1, kCount = 2;  // slopes
};

// Which kind of state a term's argument is.
struct PoseKind {
  using State = PoseState;
  static auto& of(AllStates& s) { return s.poses; }
  static const auto& of(const AllStates& s) { return s.poses; }
};
struct PlaneKind {
  using State = PlaneState;
  static auto& of(AllStates& s) { return s.planes; }
  static const auto& of(const AllStates& s) { return s.planes; }
};
struct SurfelKind {
  using State = FlatState;
  static auto& of(AllStates& s) { return s.surfels; }
  static const auto& of(const AllStates& s) { return s.surfels; }
};
struct ExtrinsicsKind {
  using State = PoseState;
  static auto& of(AllStates& s) { return s.extrinsics; }
  static const auto& of(const AllStates& s) { return s.extrinsics; }
};

enum class Kernel { kNone, kCauchyParent };

/// Weight of a term beside its own: the kernel's at this chi-squared, and the kernel's cost.
inline double kernel_weight(Kernel kernel, double chi2, double* cost) {
  if (kernel == Kernel::kNone) {
    *cost = chi2;
    return 1.0;
  }
  constexpr double c2 = kSurfelParentScale * kSurfelParentScale;
  *cost = c2 * std::log1p(chi2 / c2);
  return 1.0 / (1.0 + chi2 / c2);
}

/// All terms of one type.
template <Kernel kKernel, class Term, class... Kinds>
class Group {
 public:
  static constexpr std::size_t K = sizeof...(Kinds);
  using Index = std::array<int, K>;

  void add(const Term& term, const Index& index) {
    terms_.push_back(term);
    index_.push_back(index);
  }
  std::size_t size() const { return terms_.size(); }
  /// f(term, indices of its states) for every term.
  template <class F>
  void each(F&& f) {
    for (std::size_t i = 0; i < terms_.size(); ++i) f(terms_[i], index_[i]);
  }

  void pairs(const AllStates& states, std::vector<std::pair<int, int>>& out) const {
    for (const Index& index : index_) {
      const Index v = variables(states, index, Sequence());
      for (std::size_t a = 0; a < K; ++a) {
        for (std::size_t b = a + 1; b < K; ++b) {
          if (v[a] != kHeld && v[b] != kHeld && v[a] != v[b]) out.emplace_back(v[a], v[b]);
        }
      }
    }
  }
  void find_slots(const AllStates& states, BlockCholesky& matrix) {
    slots_.resize(K * (K + 1) / 2 * terms_.size());
    rows_.resize(terms_.size());
    for (std::size_t i = 0; i < terms_.size(); ++i) {
      const Index v = variables(states, index_[i], Sequence());
      BlockSlot* slot = &slots_[K * (K + 1) / 2 * i];
      for (std::size_t a = 0; a < K; ++a) {
        rows_[i][a] = v[a] == kHeld ? kHeld : matrix.row_of(v[a]);
        for (std::size_t b = a; b < K; ++b, ++slot) {
          if (v[a] != kHeld && v[b] != kHeld) *slot = matrix.slot(v[a], v[b]);
        }
      }
    }
  }
  /// Cost; with a gradient given also J^T J into the slots and J^T r.
  double evaluate(const AllStates& states, const std::vector<double>& weights,
                  Eigen::VectorXd* gradient) const {
    double total = 0;
    for (std::size_t i = 0; i < terms_.size(); ++i) {
      const double weight = weights.empty() ? 1.0 : weights[i];
      if (weight > 0) total += weight * evaluate_one(states, i, weight, gradient, Sequence());
    }
    return total;
  }
  void chi_squared(const AllStates& states, std::vector<double>& out) const {
    for (std::size_t i = 0; i < terms_.size(); ++i) {
      out.push_back(evaluate_one(states, i, 1.0, nullptr, Sequence()));
    }
  }

 private:
  using Sequence = std::index_sequence_for<Kinds...>;

  template <std::size_t... I>
  static Index variables(const AllStates& states, const Index& index, std::index_sequence<I...>) {
    return {Kinds::of(states).variable[static_cast<std::size_t>(index[I])]...};
  }

  template <std::size_t... I>
  double evaluate_one(const AllStates& states, std::size_t i, double weight,
                      Eigen::VectorXd* gradient, std::index_sequence<I...>) const {
    Eigen::Matrix<double, Term::kResiduals, 1> r;
    typename Term::Jacobians J;
    const Index& index = index_[i];
    terms_[i].evaluate(Kinds::of(states).now[static_cast<std::size_t>(index[I])]..., r,
                       gradient != nullptr ? &J : nullptr);
    double cost = 0;
    const double w = weight * kernel_weight(kKernel, r.squaredNorm(), &cost);
    if (gradient == nullptr) return cost;
    if (w != 1.0) {
      const double root = std::sqrt(w);
      r *= root;
      ((std::get<I>(J) *= root), ...);
    }
    const BlockSlot* slot = &slots_[K * (K + 1) / 2 * i];
    if (states.turns_only) {
      const std::tuple turning(turning_columns<typename Kinds::State>(std::get<I>(J))...);
      (scatter_row<I>(turning, r, rows_[i], slot, *gradient), ...);
    } else {
      (scatter_row<I>(J, r, rows_[i], slot, *gradient), ...);
    }
    return cost;
  }

  template <class State, class J>
  static auto turning_columns(const J& all) {
    using Columns = TurningColumns<State>;
    return all.template middleCols<Columns::kCount>(Columns::kFirst).eval();
  }

  template <std::size_t A, class Jacobians>
  static void scatter_row(const Jacobians& J, const Eigen::Matrix<double, Term::kResiduals, 1>& r,
                          const Index& rows, const BlockSlot*& slot, Eigen::VectorXd& gradient) {
    if (rows[A] == kHeld) {
      slot += K - A;
      return;
    }
    const auto& J_a = std::get<A>(J);
    constexpr int kSize = std::decay_t<decltype(J_a)>::ColsAtCompileTime;
    gradient.segment<kSize>(rows[A]).noalias() += J_a.transpose() * r;
    scatter_from<A, A>(J, rows, slot);
  }
  template <std::size_t A, std::size_t B, class Jacobians>
  static void scatter_from(const Jacobians& J, const Index& rows, const BlockSlot*& slot) {
    if (rows[B] != kHeld) {
      // Both blocks of one variable (a surfel seen from its carrier): J_a^T J_b + J_b^T J_a.
      slot->add(std::get<A>(J), std::get<B>(J));
      if constexpr (A != B && std::is_same_v<std::tuple_element_t<A, Jacobians>,
                                             std::tuple_element_t<B, Jacobians>>) {
        if (rows[A] == rows[B]) slot->add(std::get<B>(J), std::get<A>(J));
      }
    }
    ++slot;
    if constexpr (B + 1 < K) scatter_from<A, B + 1>(J, rows, slot);
  }

  std::vector<Term> terms_;
  std::vector<Index> index_;
  std::vector<Index> rows_;
  std::vector<BlockSlot> slots_;
};

}  // namespace lamina::detail
