// The factor tester passes a right factor and fails each kind of wrong one.
#include <ceres/autodiff_cost_function.h>
#include <ceres/sized_cost_function.h>
#include <ceres/sphere_manifold.h>
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/testing/factor_tester.hpp>

namespace lamina {
namespace {

using Blocks = FactorTester::Blocks;

// r = (n.x - rho, n.y): a point x against a direction n on the unit sphere, with one of several
// mistakes that have been made in factors.
enum class Mistake { kNone, kJacobian, kForgetsARow, kNeedsJacobians, kDependsOnRequest };

class PointToPlane : public ceres::SizedCostFunction<2, 3, 3> {
 public:
  explicit PointToPlane(Mistake mistake = Mistake::kNone) : mistake_(mistake) {}
  bool Evaluate(double const* const* p, double* r, double** J) const override {
    const double *n = p[0], *x = p[1];
    r[0] = n[0] * x[0] + n[1] * x[1] + n[2] * x[2] - 1.0;
    r[1] = 2.0 * n[1];
    if (mistake_ == Mistake::kDependsOnRequest && J) r[1] += 1e-12;
    if (!J) return mistake_ != Mistake::kNeedsJacobians;
    const double factor = mistake_ == Mistake::kJacobian ? 1.0001 : 1.0;
    for (int k = 0; k < 3; ++k) {
      if (J[0]) J[0][k] = factor * x[k];
      if (J[0] && mistake_ != Mistake::kForgetsARow) J[0][3 + k] = k == 1 ? 2.0 : 0.0;
      if (J[1]) J[1][k] = n[k];
      if (J[1]) J[1][3 + k] = 0;
    }
    return true;
  }

 private:
  Mistake mistake_;
};

struct Twin {
  double offset = 0;
  template <typename T>
  bool operator()(const T* n, const T* x, T* r) const {
    r[0] = n[0] * x[0] + n[1] * x[1] + n[2] * x[2] - 1.0 + offset;
    r[1] = 2.0 * n[1];
    return true;
  }
};

const ceres::SphereManifold<3> kSphere;
const Blocks kTruth{{0, 0, 1}, {3, 4, 1}};

FactorTester tester_of(const PointToPlane& cost) { return FactorTester(cost, {&kSphere, nullptr}); }

TEST(FactorTester, PassesARightFactor) {
  const PointToPlane cost;
  const ceres::AutoDiffCostFunction<Twin, 2, 3, 3> twin(new Twin);
  FactorCheck check;
  check.autodiff_twin = &twin;
  EXPECT_TRUE(tester_of(cost).check_all({kTruth, {{0, 0, -1}, {0, 0, 0}}}, check));
  EXPECT_TRUE(tester_of(cost).is_zero(kTruth));
  EXPECT_FALSE(tester_of(cost).is_zero({{0, 0, 1}, {3, 4, 1.1}}));
}

TEST(FactorTester, FailsEachMistake) {
  for (const Mistake mistake : {Mistake::kJacobian, Mistake::kForgetsARow, Mistake::kNeedsJacobians,
                                Mistake::kDependsOnRequest}) {
    const PointToPlane cost(mistake);
    EXPECT_FALSE(tester_of(cost).check_all({kTruth})) << static_cast<int>(mistake);
  }
}

TEST(FactorTester, FailsWhereTheTwinDiffers) {
  const PointToPlane cost;
  const ceres::AutoDiffCostFunction<Twin, 2, 3, 3> shifted(new Twin{1e-7});
  EXPECT_FALSE(tester_of(cost).agrees_with(shifted, kTruth));
  const PointToPlane wrong(Mistake::kJacobian);
  const ceres::AutoDiffCostFunction<Twin, 2, 3, 3> twin(new Twin);
  EXPECT_FALSE(tester_of(wrong).agrees_with(twin, kTruth));
}

TEST(FactorTester, KnowsWhatMovingTheWorldMeans) {
  const PointToPlane cost;
  const auto turned = [](const SE3& T, const Blocks& at) {
    Blocks result = at;
    const Eigen::Vector3d n = T.so3() * Eigen::Vector3d(at[0][0], at[0][1], at[0][2]);
    const Eigen::Vector3d x = T.so3() * Eigen::Vector3d(at[1][0], at[1][1], at[1][2]);
    result[0].assign(n.begin(), n.end());
    result[1].assign(x.begin(), x.end());
    return result;
  };
  // The first residual is unchanged by rotation, the second is not.
  EXPECT_FALSE(tester_of(cost).unchanged_when_moved(kTruth, turned));
  EXPECT_TRUE(tester_of(cost).unchanged_when_moved(
      kTruth, [](const SE3&, const Blocks& at) { return at; }));
}

}  // namespace
}  // namespace lamina
