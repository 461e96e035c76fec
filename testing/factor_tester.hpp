// Tests factors (ceres::CostFunction, CustomFactor): Jacobians, buffers, places where they fail,
// noise, both engines. Needs no test framework; every check gives a FactorReport.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

#include <lamina/backend/graph/graph.hpp>
#include <lamina/models/lie/se3.hpp>

namespace ceres {
class CostFunction;
class Manifold;
}  // namespace ceres

namespace lamina {

/// What a check found.
struct FactorReport {
  bool passed = true;
  std::string text;  ///< what failed and where; empty where it passed

  static FactorReport failure(std::string what) { return {false, std::move(what)}; }
  explicit operator bool() const { return passed; }
  /// To what a test framework makes of a bool and of text: EXPECT_TRUE(report) prints the text.
  template <class Result, class = std::enable_if_t<std::is_class_v<Result> &&
                                                   std::is_constructible_v<Result, const bool&>>>
  operator Result() const {
    return Result(passed) << text;
  }
};

/// How check_all() draws its points and what it holds them to.
struct FactorCheck {
  int points = 100;        ///< random points, drawn around the given ones in turn
  double spread = 0.5;     ///< 1-sigma of the random step on the manifold, each direction
  std::uint64_t seed = 1;  ///< printed with every failure
  double gradient = 1e-6;  ///< analytic against numeric, relative to the largest of the row
  double twin = 1e-9;      ///< against the twin, relative to the largest of the row
  const ceres::CostFunction* autodiff_twin = nullptr;  ///< not owned; nullptr: none to compare with
  /// Evaluate() may return false at points: those are passed over, but for one in two at most, and
  /// it must do so however it is asked. What it returns true for is finite in any case.
  bool may_fail = false;
  /// check_factor() alone: the maker registered for the factor's kind gives the same residuals.
  bool archived = false;
};

/// Checks of one cost function. Manifolds are not owned; nullptr stands for a Euclidean block.
/// Every buffer a cost function is to fill starts as NaN, so that what it forgets to write is
/// found.
class FactorTester {
 public:
  /// One value for each parameter block of a cost function, in its order.
  using Blocks = std::vector<std::vector<double>>;

  FactorTester(const ceres::CostFunction& cost, std::vector<const ceres::Manifold*> manifolds);

  /// Everything below that needs no further knowledge, at `at` and at random points around it.
  FactorReport check_all(const std::vector<Blocks>& at, const FactorCheck& check = {}) const;

  /// |residual| <= tolerance in every component: the factor is zero at the truth.
  FactorReport is_zero(const Blocks& at, double tolerance = 1e-9) const;
  /// The residual is this, in every component.
  FactorReport residual_is(const Blocks& at, const Eigen::VectorXd& expected,
                           double tolerance = 1e-9) const;
  /// ceres::GradientChecker (Ridders' method) in the manifolds' tangents agrees.
  FactorReport gradients_agree(const Blocks& at, double relative = 1e-6) const;
  /// Residuals and tangent-space Jacobians of both agree.
  FactorReport agrees_with(const ceres::CostFunction& twin, const Blocks& at,
                           double relative = 1e-9) const;
  /// Gives the same values with no Jacobians asked for, and with each single one asked for.
  FactorReport null_jacobians_allowed(const Blocks& at) const;
  /// Returns false however it is asked.
  FactorReport fails_consistently(const Blocks& at) const;
  /// Residuals are the same at both: move the whole world and give the moved blocks as `b`.
  FactorReport same_residuals(const Blocks& a, const Blocks& b, double tolerance = 1e-9) const;
  /// same_residuals for ten seeded moves T_new_old of some metres and any rotation; `moved` gives
  /// the blocks of the moved world.
  FactorReport unchanged_when_moved(const Blocks& at,
                                    const std::function<Blocks(const SE3&, const Blocks&)>& moved,
                                    double tolerance = 1e-9, std::uint64_t seed = 1) const;

  /// NaN-filled where Evaluate does not write; empty when Evaluate returns false.
  Eigen::VectorXd residuals(const Blocks& at) const;
  /// The blocks, stepped on their manifolds by normal noise of this sigma in each direction.
  Blocks perturbed(const Blocks& at, double sigma, std::mt19937_64& random) const;

 private:
  struct Evaluation {
    bool good = false;
    Eigen::VectorXd residuals;
    std::vector<Eigen::MatrixXd> jacobians;  ///< ambient; empty matrices where not asked for
  };
  Evaluation evaluate(const ceres::CostFunction& cost, const Blocks& at,
                      const std::vector<bool>& wanted) const;
  Eigen::MatrixXd to_tangent(const Eigen::MatrixXd& ambient, std::size_t block,
                             const Blocks& at) const;
  FactorReport check_at(const Blocks& at, const FactorCheck& check) const;
  /// Jacobians in the manifolds' tangents; false where Evaluate failed there or a step away.
  bool differentiate(const Blocks& at, std::vector<Eigen::MatrixXd>& analytic,
                     std::vector<Eigen::MatrixXd>& numeric) const;

  const ceres::CostFunction& cost_;
  std::vector<const ceres::Manifold*> manifolds_;
};

/// Of a factor whose states are in `graph`, at their values and around them, on their manifolds
/// (a keyframe's is PoseManifold): it fits the graph (problem_of), FactorTester::check_all() holds,
/// and the loss's derivative is that of its value.
FactorReport check_factor(const CustomFactor& factor, const Graph& graph,
                          const FactorCheck& check = {});

/// `draw` makes the factor anew with the noise it says it has, of the graph's states as the truth:
/// over `samples` draws its residuals have mean zero and unit covariance, within five standard
/// errors (Whiteness).
FactorReport noise_is_as_stated(const Graph& truth,
                                const std::function<CustomFactor(std::mt19937_64&)>& draw,
                                int samples = 2000, std::uint64_t seed = 1);

/// Both engines, native and Ceres, refine the graph: both converge, leave out the same factors and
/// end in the same robust cost (1e-6 of it) and in the same states, `tolerance` in metres, radians
/// and a custom state's tangent.
FactorReport engines_agree(const Graph& graph, double tolerance = 1e-4);

}  // namespace lamina
