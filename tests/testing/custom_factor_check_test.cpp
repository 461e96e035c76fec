// The checks of custom factors pass right ones and fail each kind of wrong one.
#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/sized_cost_function.h>
#include <ceres/sphere_manifold.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lamina/testing/factor_tester.hpp>

#include "support/up_residual.hpp"

namespace lamina {
namespace {

using test::Up;

using ::testing::HasSubstr;

// (t - position) / sigma of a keyframe, with one of several mistakes; it sees nothing past x = 4.
enum class Mistake { kNone, kSlope, kFailsOnlyWithJacobians };

class Position : public ceres::SizedCostFunction<3, 7> {
 public:
  Position(Eigen::Vector3d at, double sigma, Mistake mistake = Mistake::kNone)
      : at_(std::move(at)), sigma_(sigma), mistake_(mistake) {}
  bool Evaluate(double const* const* p, double* r, double** J) const override {
    if (p[0][0] > 4 && (J != nullptr || mistake_ != Mistake::kFailsOnlyWithJacobians)) {
      return false;
    }
    for (int i = 0; i < 3; ++i) r[i] = (p[0][i] - at_(i)) / sigma_;
    if (J == nullptr || J[0] == nullptr) return true;
    std::fill(J[0], J[0] + 21, 0.0);
    const double slope = mistake_ == Mistake::kSlope ? 1.001 : 1;
    for (int i = 0; i < 3; ++i) J[0][8 * i] = slope / sigma_;
    return true;
  }

 private:
  Eigen::Vector3d at_;
  double sigma_;
  Mistake mistake_;
};

struct RisingLoss : ceres::LossFunction {  // whose slope is not the value's
  void Evaluate(double s, double rho[3]) const override {
    rho[0] = s;
    rho[1] = 0.5;
    rho[2] = 0;
  }
};

// Three keyframes in a row, a position for each, a direction that two of them read.
Graph row() {
  Graph graph;
  for (int i = 0; i < 3; ++i) {
    graph.add_keyframe(Timestamp::from_seconds(i), SE3(SO3::rot_x(0.2), {1.0 * i, 0.1 * i, 0}));
  }
  CustomState up;
  up.values = Eigen::Vector3d(0, 0.1, 1).normalized();
  up.manifold = std::make_shared<ceres::SphereManifold<3>>();
  graph.add_custom_state(up);
  return graph;
}

CustomFactor position(double x, Mistake mistake = Mistake::kNone) {
  CustomFactor factor;
  factor.kind = "position";
  factor.states = {KeyframeId(1)};
  factor.cost = std::make_shared<Position>(Eigen::Vector3d(x, 0, 0), 0.1, mistake);
  factor.data = {x};
  return factor;
}

CustomFactor up(int keyframe) {
  CustomFactor factor;
  factor.kind = "up";
  factor.states = {KeyframeId(keyframe), CustomStateId(0)};
  factor.cost = std::make_shared<ceres::AutoDiffCostFunction<Up, 3, 7, 3>>(new Up);
  return factor;
}

TEST(CheckFactor, PassesRightOnes) {
  EXPECT_TRUE(check_factor(position(1.2), row()));
  EXPECT_TRUE(check_factor(up(1), row()));
  CustomFactor robust = up(2);
  robust.loss = std::make_shared<ceres::CauchyLoss>(2.0);
  EXPECT_TRUE(check_factor(robust, row()));
}

TEST(CheckFactor, FailsEachMistake) {
  EXPECT_THAT(check_factor(position(1, Mistake::kSlope), row()).text, HasSubstr("Jacobian"));
  CustomFactor factor = position(1);
  factor.loss = std::make_shared<RisingLoss>();
  EXPECT_THAT(check_factor(factor, row()).text, HasSubstr("slope"));
  factor = position(1);
  factor.states = {KeyframeId(7)};
  EXPECT_THAT(check_factor(factor, row()).text, HasSubstr("missing state"));
}

TEST(CheckFactor, WhereItCannotBeEvaluatedIsPassedOver) {
  Graph graph = row();
  graph.keyframes[1].T_map_body = SE3::from_translation({3.2, 0, 0});
  FactorCheck check;
  EXPECT_THAT(check_factor(position(1), graph, check).text, HasSubstr("Evaluate failed"));
  check.may_fail = true;
  EXPECT_TRUE(check_factor(position(1), graph, check));
  EXPECT_THAT(check_factor(position(1, Mistake::kFailsOnlyWithJacobians), graph, check).text,
              HasSubstr("fail"));
  graph.keyframes[1].T_map_body = SE3::from_translation({70, 0, 0});
  EXPECT_THAT(check_factor(position(1), graph, check).text, HasSubstr("101 of 101 points"));
}

TEST(CheckFactor, MadeAnewFromItsArchive) {
  FactorCheck check;
  check.archived = true;
  EXPECT_THAT(check_factor(position(1), row(), check).text, HasSubstr("register_factor"));
  register_factor("position", [](const std::vector<double>& data) { return position(data[0]); });
  EXPECT_TRUE(check_factor(position(1), row(), check));
  register_factor("position", [](const std::vector<double>&) { return position(0); });
  EXPECT_THAT(check_factor(position(1), row(), check).text, HasSubstr("made anew"));
}

TEST(NoiseIsAsStated, OrNot) {
  const auto drawn = [](double sigma) {
    return [sigma](std::mt19937_64& random) {
      std::normal_distribution<double> noise(0, sigma);
      CustomFactor factor = position(0);
      Eigen::Vector3d at(1, 0.1, 0);
      for (double& x : at) x += noise(random);
      factor.cost = std::make_shared<Position>(at, 0.1);
      return factor;
    };
  };
  EXPECT_TRUE(noise_is_as_stated(row(), drawn(0.1)));
  EXPECT_THAT(noise_is_as_stated(row(), drawn(0.08)).text, HasSubstr("covariance"));
}

TEST(EnginesAgree, OnRightFactorsAndSayWhereNot) {
  Graph graph = row();
  for (int i = 0; i < 3; ++i) {
    CustomFactor factor = position(1.1 * i + 0.05);
    factor.states = {KeyframeId(i)};
    graph.custom.push_back(factor);
    graph.priors.push_back({KeyframeId(i), SE3::planar(i, 0.05 * i, 0), Matrix6d::Identity() * 20});
    graph.custom.push_back(up(i));
  }
  EXPECT_TRUE(engines_agree(graph));
  graph.custom[2].cost = std::make_shared<Position>(Eigen::Vector3d(80, 0, 0), 0.1);
  graph.keyframes[1].T_map_body = SE3::from_translation({60, 0, 0});
  EXPECT_THAT(engines_agree(graph).text, HasSubstr("cannot be evaluated"));
}

}  // namespace
}  // namespace lamina
