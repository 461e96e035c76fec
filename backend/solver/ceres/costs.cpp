// Terms as Ceres cost functions.
#include <lamina/backend/solver/ceres/costs.hpp>

#include <ceres/sized_cost_function.h>

#include <utility>

#include <lamina/backend/graph/factors/gravity.hpp>
#include <lamina/backend/graph/factors/marginal_prior.hpp>
#include <lamina/backend/graph/factors/of_sensor.hpp>
#include <lamina/backend/graph/factors/prior.hpp>
#include <lamina/backend/graph/factors/segment.hpp>
#include <lamina/backend/graph/factors/surfel_moments.hpp>
#include <lamina/backend/graph/factors/surfel_parent.hpp>
#include <lamina/backend/solver/ceres/lift.hpp>

namespace lamina {
namespace {

template <class Term, class... States>
class TermCost final : public ceres::SizedCostFunction<Term::kResiduals, States::kAmbient...> {
 public:
  explicit TermCost(const Term& term) : term_(term) {}
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    return evaluate(parameters, residuals, jacobians, std::index_sequence_for<States...>());
  }

 private:
  template <std::size_t... I>
  bool evaluate(const double* const* parameters, double* residuals, double** jacobians,
                std::index_sequence<I...>) const {
    const std::tuple<States...> states{States(parameters[I])...};
    Eigen::Matrix<double, Term::kResiduals, 1> r;
    typename Term::Jacobians J;
    term_.evaluate(std::get<I>(states)..., r, jacobians != nullptr ? &J : nullptr);
    Eigen::Matrix<double, Term::kResiduals, 1>::Map(residuals) = r;
    if (jacobians == nullptr) return true;
    const auto one = [&](auto index) {
      constexpr std::size_t k = decltype(index)::value;
      if (jacobians[k] == nullptr) return;
      lift(std::get<k>(states), parameters[k], std::get<k>(J), jacobians[k]);
    };
    (one(std::integral_constant<std::size_t, I>()), ...);
    return true;
  }

  Term term_;
};

class MarginalCost final : public ceres::CostFunction {
 public:
  explicit MarginalCost(const MarginalPrior& prior) : prior_(prior) {
    set_num_residuals(static_cast<int>(prior_.residual.size()));
    for (std::size_t i = 0; i < prior_.keyframes.size(); ++i) add(PoseState::kAmbient);
    for (std::size_t i = 0; i < prior_.planes.size(); ++i) add(PlaneState::kAmbient);
    for (std::size_t i = 0; i < prior_.surfels.size(); ++i) add(FlatState::kAmbient);
  }
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    std::vector<PoseState> poses;
    std::vector<PlaneState> planes;
    std::vector<FlatState> surfels;
    const double* const* x = parameters;
    for (std::size_t i = 0; i < prior_.keyframes.size(); ++i) poses.emplace_back(*x++);
    for (std::size_t i = 0; i < prior_.planes.size(); ++i) planes.emplace_back(*x++);
    for (std::size_t i = 0; i < prior_.surfels.size(); ++i) surfels.emplace_back(*x++);
    Eigen::VectorXd r;
    Eigen::MatrixXd J;
    evaluate_marginal_prior(prior_, poses, planes, surfels, r, jacobians != nullptr ? &J : nullptr);
    Eigen::VectorXd::Map(residuals, r.size()) = r;
    if (jacobians == nullptr) return true;
    std::size_t block = 0;
    Eigen::Index at = 0;
    const auto lift_all = [&](const auto& states) {
      using State = typename std::decay_t<decltype(states)>::value_type;
      for (const auto& state : states) {
        if (jacobians[block] != nullptr) {
          lift(state, parameters[block], J.middleCols<State::kTangent>(at), jacobians[block]);
        }
        ++block;
        at += State::kTangent;
      }
    };
    lift_all(poses);
    lift_all(planes);
    lift_all(surfels);
    return true;
  }

 private:
  void add(int size) { mutable_parameter_block_sizes()->push_back(size); }
  MarginalPrior prior_;
};

}  // namespace

ceres::CostFunction* make_cost(const OdometryTerm& term) {
  return new TermCost<OdometryTerm, PoseState, PoseState>(term);
}
ceres::CostFunction* make_cost(const PlanarOdometryTerm& term) {
  return new TermCost<PlanarOdometryTerm, PoseState, PoseState>(term);
}
ceres::CostFunction* make_cost(const PriorTerm& term) {
  return new TermCost<PriorTerm, PoseState>(term);
}
ceres::CostFunction* make_cost(const PlaneMomentsTerm& term) {
  return new TermCost<PlaneMomentsTerm, PoseState, PlaneState>(term);
}
ceres::CostFunction* make_cost(const OdometryOfSensorTerm& term) {
  return new TermCost<OdometryOfSensorTerm, PoseState, PoseState, PoseState>(term);
}
ceres::CostFunction* make_cost(const PlaneMomentsOfSensorTerm& term) {
  return new TermCost<PlaneMomentsOfSensorTerm, PoseState, PlaneState, PoseState>(term);
}
ceres::CostFunction* make_cost(const SegmentTerm& term) {
  return new TermCost<SegmentTerm, PoseState, PlaneState>(term);
}
ceres::CostFunction* make_cost(const GravityTerm& term) {
  return new TermCost<GravityTerm, PoseState>(term);
}
ceres::CostFunction* make_cost(const SurfelMomentsOwnTerm& term) {
  return new TermCost<SurfelMomentsOwnTerm, FlatState>(term);
}
ceres::CostFunction* make_cost(const SurfelMomentsTerm& term) {
  return new TermCost<SurfelMomentsTerm, PoseState, PoseState, FlatState>(term);
}
ceres::CostFunction* make_cost(const SurfelParentTerm& term) {
  return new TermCost<SurfelParentTerm, PoseState, PlaneState, FlatState>(term);
}
ceres::CostFunction* make_cost(const MarginalPrior& prior) { return new MarginalCost(prior); }

}  // namespace lamina
