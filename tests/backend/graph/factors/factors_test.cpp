// Factors between poses: zero at truth, one number by hand, gradients, autodiff twin, moved world,
// whitening.
#include <gtest/gtest.h>

#include <lamina/backend/graph/factors/gravity.hpp>
#include <lamina/backend/graph/factors/marginal_prior.hpp>
#include <lamina/backend/graph/factors/of_sensor.hpp>
#include <lamina/backend/graph/factors/prior.hpp>
#include <lamina/backend/solver/ceres/costs.hpp>

#include "backend/graph/factor_cases.hpp"
#include "backend/graph/factor_twins.hpp"

namespace lamina {
namespace {

using namespace test;

TEST(OdometryFactor, PassesAllChecks) {
  Random random(1);
  OdometryFactor f;
  f.T_from_to = SE3(SO3::exp({0.1, -0.4, 0.3}), {1, 2, -0.5});
  f.sqrt_information = some_root<6>(random);
  const Cost cost(make_cost(OdometryTerm(f)));
  const Cost twin(twins::Odometry::make(f));
  const FactorTester tester(*cost, {&kPose, &kPose});
  const SE3 a(SO3::exp({1, 2, -1}), {3, 1, 2});
  const Blocks truth{block(a), block(a * f.T_from_to)};
  EXPECT_TRUE(tester.is_zero(truth));
  const SE3 half_turn = a * f.T_from_to * SE3(SO3::rot_x(M_PI - 0.05), {0.2, 0, 0});
  FactorCheck check;
  check.spread = 0.3;
  check.autodiff_twin = twin.get();
  EXPECT_TRUE(tester.check_all({truth}, check));
  check.points = 5;
  check.spread = 0.002;
  EXPECT_TRUE(tester.check_all({{block(a), block(half_turn)}}, check));
  EXPECT_TRUE(tester.unchanged_when_moved(truth, [](const SE3& T, const Blocks& at) {
    return Blocks{block(T * pose_of(at[0])), block(T * pose_of(at[1]))};
  }));
  // By hand: 0.2 m too far ahead with sigma 0.1 m is 2.
  f.sqrt_information = 10 * Matrix6d::Identity();
  const Cost plain(make_cost(OdometryTerm(f)));
  Vector6d expected = Vector6d::Zero();
  expected(0) = 2;
  EXPECT_TRUE(
      FactorTester(*plain, {&kPose, &kPose})
          .residual_is({block(SE3()), block(f.T_from_to * SE3::planar(0.2, 0, 0))}, expected));
}

TEST(PlanarOdometryFactor, PassesAllChecks) {
  Random random(2);
  PlanarOdometryFactor f;
  f.T_from_to = SE3::planar(1, 0.2, 0.3);
  f.sqrt_information = some_root<3>(random);
  const Cost cost(make_cost(PlanarOdometryTerm(f)));
  const Cost twin(twins::PlanarOdometry::make(f));
  const FactorTester tester(*cost, {&kPose, &kPose});
  const SE3 a(SO3::exp({0.1, 0.2, -1}), {3, 1, 2});
  FactorCheck check;
  check.spread = 0.3;
  check.autodiff_twin = twin.get();
  EXPECT_TRUE(tester.check_all({{block(a), block(a * f.T_from_to)}}, check));
  // Height is free.
  EXPECT_TRUE(
      tester.is_zero({block(SE3()), block(f.T_from_to * SE3::from_translation({0, 0, 1}))}));
}

TEST(PriorFactor, PassesAllChecks) {
  Random random(3);
  PriorFactor f;
  f.T_map_body = SE3(SO3::exp({1, 0.2, -2}), {5, -2, 1});
  f.sqrt_information = some_root<6>(random);
  const Cost cost(make_cost(PriorTerm(f)));
  const Cost twin(twins::Prior::make(f));
  const FactorTester tester(*cost, {&kPose});
  FactorCheck check;
  check.autodiff_twin = twin.get();
  EXPECT_TRUE(tester.is_zero({block(f.T_map_body)}));
  EXPECT_TRUE(tester.check_all({{block(f.T_map_body)}}, check));
  // Of a sensor by hand: 0.06 m too far ahead with sigma 0.03 m is 2.
  const Extrinsics sensor = Extrinsics::at("lidar", f.T_map_body);
  const Cost extrinsics(make_cost(PriorTerm(sensor)));
  Vector6d expected = Vector6d::Zero();
  expected(0) = 2;
  EXPECT_TRUE(FactorTester(*extrinsics, {&kPose})
                  .residual_is({block(f.T_map_body * SE3::planar(0.06, 0, 0))}, expected));
}

TEST(OdometryOfSensorFactor, PassesAllChecks) {
  Random random(4);
  OdometryFactor f;
  f.T_from_to = SE3(SO3::exp({0.1, -0.4, 0.3}), {1, 2, -0.5});
  f.sqrt_information = some_root<6>(random);
  const SE3 E(SO3::exp({0.3, 1.2, -2}), {0.2, 0.1, 0.8});
  const OdometryOfSensorTerm term(f, Extrinsics::at("lidar", E));
  const Cost cost(make_cost(term));
  OdometryFactor of_sensor;
  of_sensor.T_from_to = E.inverse() * f.T_from_to * E;
  of_sensor.sqrt_information = f.sqrt_information * E.adjoint();
  using Twin = ceres::AutoDiffCostFunction<twins::OdometryOfSensor, 6, 7, 7, 7>;
  const Cost twin(new Twin(new twins::OdometryOfSensor{{of_sensor}}));
  const FactorTester tester(*cost, {&kPose, &kPose, &kPose});
  const SE3 a(SO3::exp({1, 2, -1}), {3, 1, 2});
  const Blocks truth{block(a), block(a * f.T_from_to), block(E)};
  EXPECT_TRUE(tester.is_zero(truth));
  FactorCheck check;
  check.spread = 0.3;
  check.autodiff_twin = twin.get();
  EXPECT_TRUE(tester.check_all({truth}, check));
  EXPECT_TRUE(tester.unchanged_when_moved(truth, [](const SE3& T, const Blocks& at) {
    return Blocks{block(T * pose_of(at[0])), block(T * pose_of(at[1])), at[2]};
  }));
  // Where the sensor is as the factor was made, the residual is the body's own.
  const Blocks moved{block(a), block(a * f.T_from_to * SE3(SO3::exp({0.1, 0, 0.2}), {0.3, 0, 0})),
                     block(E)};
  const Cost of_body(make_cost(OdometryTerm(f)));
  EXPECT_LT((tester.residuals(moved) -
             FactorTester(*of_body, {&kPose, &kPose}).residuals({moved[0], moved[1]}))
                .norm(),
            1e-9);
}

TEST(GravityFactor, PassesAllChecks) {
  GravityFactor f;
  f.up_body = Eigen::Vector3d(0.1, -0.2, 1).normalized();
  f.sigma = 0.1;
  const Cost cost(make_cost(GravityTerm(f)));
  const Cost twin(new ceres::AutoDiffCostFunction<twins::Gravity, 2, 7>(new twins::Gravity{f}));
  const FactorTester tester(*cost, {&kPose});
  const SE3 level(SO3(Eigen::Quaterniond::FromTwoVectors(f.up_body, Eigen::Vector3d::UnitZ())),
                  {1, 2, 3});
  EXPECT_TRUE(tester.is_zero({block(level)}));
  EXPECT_TRUE(tester.is_zero({block(SE3::planar(4, 5, 1) * level)}));
  FactorCheck check;
  check.spread = 0.25;
  check.autodiff_twin = twin.get();
  EXPECT_TRUE(
      tester.check_all({{block(level)}, {block(level * SE3(SO3::rot_x(1.2), {0, 0, 0}))}}, check));
  f.up_body = Eigen::Vector3d::UnitZ();
  const Cost plain(make_cost(GravityTerm(f)));
  const auto r = FactorTester(*plain, {&kPose}).residuals({block(SE3(SO3::rot_x(0.3), {0, 0, 0}))});
  EXPECT_NEAR(r.norm(), 3, 1e-9);
  // Upside down is as wrong as can be, and no NaN.
  const auto upside_down =
      FactorTester(*plain, {&kPose}).residuals({block(SE3(SO3::rot_x(M_PI), {0, 0, 0}))});
  EXPECT_NEAR(upside_down.norm(), 10 * M_PI, 1e-6);
}

TEST(MarginalPriorFactor, PassesAllChecks) {
  Random random(10);
  MarginalPrior f;
  f.keyframes = {KeyframeId(3)};
  f.poses_linear = {SE3(SO3::exp({1, 0.2, -2}), {5, -2, 1})};
  f.planes = {PlaneId(1)};
  f.planes_linear = {Plane({0.3, -0.5, -1}, 0.2)};
  f.sqrt_information = Eigen::MatrixXd::Zero(5, 9);
  for (int i = 0; i < 45; ++i) f.sqrt_information(i % 5, i / 5) = random.normal();
  f.residual = random.normal_vector(5);
  const Cost cost(make_cost(f));
  const Cost twin(
      new ceres::AutoDiffCostFunction<twins::Marginal, 5, 7, 4>(new twins::Marginal{f}));
  const FactorTester tester(*cost, {&kPose, &kPlane});
  const Blocks linear{block(f.poses_linear[0]), block(f.planes_linear[0])};
  EXPECT_TRUE(tester.residual_is(linear, f.residual));
  FactorCheck check;
  check.spread = 0.3;
  check.autodiff_twin = twin.get();
  EXPECT_TRUE(tester.check_all({linear}, check));
}

}  // namespace
}  // namespace lamina
