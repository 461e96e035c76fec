// Tests a factor (a ceres::CostFunction): Jacobians, buffers, twin, invariance, whitening.
#pragma once

#include <ceres/cost_function.h>
#include <ceres/manifold.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include <lamina/models/lie/se3.hpp>

#include "support/random.hpp"
#include "support/statistics.hpp"

namespace lamina::test {

/// One value for each parameter block of a cost function, in its order.
using Blocks = std::vector<std::vector<double>>;

/// How check_all() draws its points and what it holds them to.
struct FactorCheck {
  int points = 100;        ///< random points, drawn around the given ones in turn
  double spread = 0.5;     ///< 1-sigma of the random step on the manifold, each direction
  std::uint64_t seed = 1;  ///< printed with every failure
  double gradient = 1e-6;  ///< analytic against numeric, relative to the largest of the row
  double twin = 1e-9;      ///< against the twin, relative to the largest of the row
  const ceres::CostFunction* autodiff_twin = nullptr;  ///< not owned; nullptr: none to compare with
};

/// Checks of one cost function. All return what gtest prints; wrap them in EXPECT_TRUE.
/// Manifolds are not owned; nullptr stands for a Euclidean block. Every buffer a cost function is
/// to fill starts as NaN, so that what it forgets to write is found.
class FactorTester {
 public:
  FactorTester(const ceres::CostFunction& cost, std::vector<const ceres::Manifold*> manifolds);

  /// Everything below that needs no further knowledge, at `at` and at random points around it.
  testing::AssertionResult check_all(const std::vector<Blocks>& at,
                                     const FactorCheck& check = {}) const;

  /// |residual| <= tolerance in every component: the factor is zero at the truth.
  testing::AssertionResult is_zero(const Blocks& at, double tolerance = 1e-9) const;
  /// The residual is this, in every component.
  testing::AssertionResult residual_is(const Blocks& at, const Eigen::VectorXd& expected,
                                       double tolerance = 1e-9) const;
  /// ceres::GradientChecker (Ridders' method) in the manifolds' tangents agrees.
  testing::AssertionResult gradients_agree(const Blocks& at, double relative = 1e-6) const;
  /// Residuals and tangent-space Jacobians of both agree.
  testing::AssertionResult agrees_with(const ceres::CostFunction& twin, const Blocks& at,
                                       double relative = 1e-9) const;
  /// Gives the same values with no Jacobians asked for, and with each single one asked for.
  testing::AssertionResult null_jacobians_allowed(const Blocks& at) const;
  /// Residuals are the same at both: move the whole world and give the moved blocks as `b`.
  testing::AssertionResult same_residuals(const Blocks& a, const Blocks& b,
                                          double tolerance = 1e-9) const;
  /// same_residuals for ten seeded moves T_new_old of some metres and any rotation; `moved` gives
  /// the blocks of the moved world.
  testing::AssertionResult unchanged_when_moved(
      const Blocks& at, const std::function<Blocks(const SE3&, const Blocks&)>& moved,
      double tolerance = 1e-9, std::uint64_t seed = 1) const;

  /// NaN-filled where Evaluate does not write; empty when Evaluate returns false.
  Eigen::VectorXd residuals(const Blocks& at) const;
  /// The blocks, stepped on their manifolds by normal noise of this sigma in each direction.
  Blocks perturbed(const Blocks& at, double sigma, Random& random) const;

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

  const ceres::CostFunction& cost_;
  std::vector<const ceres::Manifold*> manifolds_;
};

}  // namespace lamina::test
