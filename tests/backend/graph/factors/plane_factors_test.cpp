// Factors on planes and surfels: zero at truth, one number by hand, gradients, autodiff twin, moved
// world, whitening.
#include <gtest/gtest.h>

#include <lamina/backend/graph/factors/of_sensor.hpp>
#include <lamina/backend/graph/factors/segment.hpp>
#include <lamina/backend/graph/factors/surfel_moments.hpp>
#include <lamina/backend/graph/factors/surfel_parent.hpp>
#include <lamina/backend/solver/ceres/costs.hpp>

#include "backend/graph/factor_cases.hpp"
#include "backend/graph/factor_twins.hpp"
#include "support/statistics.hpp"

namespace lamina {
namespace {

using namespace test;

struct PlaneCase {
  const char* name;
  Plane plane_map;
  SE3 pose;
};

std::vector<PlaneCase> plane_cases() {
  return {{"wall", Plane({1, 0.2, 0.1}, 4), SE3(SO3::exp({0.2, 0.1, 1}), {1, 2, 1})},
          {"floor", Plane(Eigen::Vector3d::UnitZ(), 0), SE3(SO3::exp({0, 0, 2}), {1, 2, 1})},
          {"ceiling", Plane(-Eigen::Vector3d::UnitZ(), -3), SE3(SO3(), {1, 2, 1})},
          {"rho is zero", Plane({1, 1, 0}, 0), SE3(SO3::exp({0, 0, 1}), {3, 2, 1})},
          {"sensor on the plane", Plane(Eigen::Vector3d::UnitX(), 1), SE3(SO3(), {1, 2, 1})},
          {"half a turn", Plane({0, 1, 0.1}, 4), SE3(SO3::rot_z(M_PI - 1e-6), {1, 2, 1})}};
}

// A segment on the plane, seen from the pose.
SegmentFactor segment_of(const PlaneCase& c, Random& random) {
  SegmentFactor f;
  const auto ends = random.points_on(c.plane_map, {4, 2, 0}, 2.0, 2);
  f.start_body = c.pose.inverse() * ends[0];
  f.end_body = c.pose.inverse() * ends[1];
  f.sqrt_information << 100, 0, 20, 50;
  return f;
}

TEST(PlaneMomentsFactor, PassesAllChecks) {
  Random random(4);
  for (const auto& c : plane_cases()) {
    const PlaneLandmark landmark = PlaneLandmark::at(c.plane_map, {4, 3, 0});
    const Moments moments = seen(c.plane_map, c.pose, {4, 2, 0}, random);
    const PlaneMomentsTerm term(moments, landmark.anchor_map);
    const Cost cost(make_cost(term));
    const Cost twin(new ceres::AutoDiffCostFunction<twins::PlaneMoments, 4, 7, 4>(
        new twins::PlaneMoments{term.root_weight, term.mean_body, term.anchor_map, term.rows}));
    const FactorTester tester(*cost, {&kPose, &kPlane});
    const Blocks truth{block(c.pose), block(landmark.plane_anchor)};
    EXPECT_TRUE(tester.is_zero(truth, 1e-6)) << c.name;
    FactorCheck check;
    check.points = 20;
    check.autodiff_twin = twin.get();
    EXPECT_TRUE(tester.check_all({truth}, check)) << c.name;
  }
}

TEST(PlaneMomentsFactor, IsTheSumOverPoints) {
  Random random(5);
  const Plane plane({1, 0.2, 0.1}, 4);
  const SE3 pose(SO3::exp({0.2, 0.1, 1}), {1, 2, 1});
  const Moments moments = seen(plane, pose, {4, 2, 0}, random, 0.05);
  const Plane other = plane.boxplus({0.1, -0.2, 0.3});
  const Eigen::Vector3d anchor(3, 1, 0);
  const Cost cost(make_cost(PlaneMomentsTerm(moments, anchor)));
  const auto r =
      FactorTester(*cost, {&kPose, &kPlane}).residuals({block(pose), block(other.about(anchor))});
  const double expected = moments.cost(pose.inverse() * other);
  EXPECT_NEAR(r.squaredNorm(), expected, 1e-9 * expected);
}

TEST(PlaneMomentsFactor, SameFarFromTheOrigin) {
  Random random(6);
  const Plane plane({1, 0.2, 0.1}, 4);
  const SE3 pose(SO3::exp({0.2, 0.1, 1}), {1, 2, 1});
  const Moments moments = seen(plane, pose, {4, 2, 0}, random, 0.01);
  const SE3 away(SO3::exp({0.3, -1, 2}), {4000, -3000, 20});
  const auto residual = [&](const SE3& move) {
    const PlaneLandmark landmark = PlaneLandmark::at(move * plane, move * Eigen::Vector3d(4, 2, 0));
    const Cost cost(make_cost(PlaneMomentsTerm(moments, landmark.anchor_map)));
    return FactorTester(*cost, {&kPose, &kPlane})
        .residuals({block(move * pose), block(landmark.plane_anchor)});
  };
  EXPECT_LT((residual(SE3()) - residual(away)).norm(), 1e-7);
}

TEST(PlaneMomentsFactor, WhitenedByItsNoiseModel) {
  const Plane plane({1, 0.2, 0.1}, 4);
  const SE3 pose(SO3::exp({0.2, 0.1, 1}), {1, 2, 1});
  const auto landmark = PlaneLandmark::at(plane, {4, 2, 0});
  const double sigma = 0.01;
  const NoiseFloor floor{0.003, 0.001};
  // The four residuals of a full view have three directions: measure them along those.
  EXPECT_TRUE(test::has_unit_covariance([&](Random& random) -> Eigen::VectorXd {
    Moments moments = seen(plane, pose, {4, 2, 0}, random, sigma);
    const auto fit = moments.fit_plane(Eigen::Vector3d::Zero(), 1.0);
    const Plane shifted =
        fit->plane.about(moments.mean())
            .boxplus({random.normal(floor.sigma_tilt), random.normal(floor.sigma_tilt),
                      random.normal(floor.sigma_rho)});
    const SE3 turn(SO3(Eigen::Quaterniond::FromTwoVectors(fit->plane.normal(), shifted.normal())),
                   {0, 0, 0});
    const SE3 about = SE3::from_translation(moments.mean() + shifted.rho() * shifted.normal()) *
                      turn * SE3::from_translation(-moments.mean());
    moments = moments.transformed(about).discounted(shifted.normal(), floor);
    const PlaneMomentsTerm term(moments, landmark.anchor_map);
    Eigen::Vector4d r;
    term.evaluate(PoseState(pose), PlaneState(landmark.plane_anchor), r, nullptr);
    return r.head<3>();
  }));
}

TEST(PlaneMomentsFactor, SegmentConstrainsTwoDirections) {
  Moments moments;
  for (int i = 0; i < 10; ++i) moments.add({2, 0.1 * i, 0}, 100);
  const PlaneMomentsTerm term(
      moments.discounted(-Eigen::Vector3d::UnitX(), NoiseFloor{0.01, 0.001}), {2, 0, 0});
  PlaneMomentsTerm::Jacobians J;
  Eigen::Vector4d r;
  term.evaluate(PoseState(SE3()), PlaneState(Plane(-Eigen::Vector3d::UnitX(), 0)), r, &J);
  const Eigen::Matrix3d H = std::get<1>(J).transpose() * std::get<1>(J);
  EXPECT_NEAR(H.determinant(), 0, 1e-9 * H.trace() * H.trace() * H.trace());
  EXPECT_GT(H.trace(), 1);
}

TEST(PlaneMomentsOfSensorFactor, PassesAllChecks) {
  Random random(7);
  const SE3 E(SO3::exp({0.3, 1.2, -2}), {0.2, 0.1, 0.8});
  for (const auto& c : plane_cases()) {
    const PlaneLandmark landmark = PlaneLandmark::at(c.plane_map, {4, 3, 0});
    const Moments moments = seen(c.plane_map, c.pose, {4, 2, 0}, random);
    const PlaneMomentsOfSensorTerm term(moments, landmark.anchor_map,
                                        Extrinsics::at("depth_camera", E));
    const Cost cost(make_cost(term));
    using Twin = ceres::AutoDiffCostFunction<twins::PlaneMomentsOfSensor, 4, 7, 4, 7>;
    const PlaneMomentsTerm& n = term.of_sensor;
    const Cost twin(new Twin(
        new twins::PlaneMomentsOfSensor{{n.root_weight, n.mean_body, n.anchor_map, n.rows}}));
    const FactorTester tester(*cost, {&kPose, &kPlane, &kPose});
    const Blocks truth{block(c.pose), block(landmark.plane_anchor), block(E)};
    EXPECT_TRUE(tester.is_zero(truth, 1e-6)) << c.name;
    FactorCheck check;
    check.points = 10;
    check.spread = 0.2;
    check.autodiff_twin = twin.get();
    EXPECT_TRUE(tester.check_all({truth}, check)) << c.name;
  }
}

TEST(SegmentFactor, PassesAllChecks) {
  Random random(8);
  for (const auto& c : plane_cases()) {
    const PlaneLandmark landmark = PlaneLandmark::at(c.plane_map, {4, 3, 0});
    const SegmentFactor f = segment_of(c, random);
    const Cost cost(make_cost(SegmentTerm(f, landmark.anchor_map)));
    const Cost twin(new ceres::AutoDiffCostFunction<twins::Segment, 2, 7, 4>(
        new twins::Segment{f, landmark.anchor_map}));
    const FactorTester tester(*cost, {&kPose, &kPlane});
    const Blocks truth{block(c.pose), block(landmark.plane_anchor)};
    EXPECT_TRUE(tester.is_zero(truth, 1e-8)) << c.name;
    FactorCheck check;
    check.points = 20;
    check.autodiff_twin = twin.get();
    EXPECT_TRUE(tester.check_all({truth}, check)) << c.name;
  }
}

// The same cost and the same normal equations at every pose and plane.
TEST(SegmentFactor, IsAMomentsFactorToTheLastDigits) {
  Random random(12);
  for (const auto& c : plane_cases()) {
    const PlaneLandmark landmark = PlaneLandmark::at(c.plane_map, {4, 3, 0});
    const SegmentFactor f = segment_of(c, random);
    const SegmentTerm segment(f, landmark.anchor_map);
    const PlaneMomentsTerm moments(moments_of(f, 30), landmark.anchor_map);
    for (int i = 0; i < 20; ++i) {
      const PoseState pose = PoseState(c.pose).plus(random.normal_vector(6, 0.3));
      const PlaneState plane = PlaneState(landmark.plane_anchor).plus(random.normal3(0.3));
      Eigen::Vector2d r;
      Eigen::Vector4d r_moments;
      SegmentTerm::Jacobians J;
      PlaneMomentsTerm::Jacobians J_moments;
      segment.evaluate(pose, plane, r, &J);
      moments.evaluate(pose, plane, r_moments, &J_moments);
      EXPECT_NEAR(r_moments.squaredNorm(), r.squaredNorm(), 1e-9 * r.squaredNorm()) << c.name;
      Eigen::Matrix<double, 2, 9> A;
      Eigen::Matrix<double, 4, 9> B;
      A << std::get<0>(J), std::get<1>(J);
      B << std::get<0>(J_moments), std::get<1>(J_moments);
      const Eigen::Matrix<double, 9, 9> H = A.transpose() * A;
      EXPECT_LT((B.transpose() * B - H).norm(), 1e-9 * H.norm()) << c.name;
      EXPECT_LT((B.transpose() * r_moments - A.transpose() * r).norm(),
                1e-9 * (A.transpose() * r).norm() + 1e-9)
          << c.name;
    }
  }
  SegmentFactor none;
  none.sqrt_information.setZero();
  EXPECT_EQ(moments_of(none, 30).weight(), 0);
}

TEST(SegmentFactor, WhitenedByTheFit) {
  // Points of a vertical wall in a level scan: x = 3, y from -1 to 2.
  const double sigma = 0.02;
  EXPECT_TRUE(test::has_unit_covariance([&](Random& random) -> Eigen::VectorXd {
    Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
    Eigen::Vector2d b = Eigen::Vector2d::Zero();
    for (int i = 0; i < 30; ++i) {
      const double y = -1 + 0.1 * i;
      const Eigen::Vector2d g(1, -y);  // x - 3 = d rho - y d theta to first order
      A += g * g.transpose() / (sigma * sigma);
      b += g * random.normal(sigma) / (sigma * sigma);
    }
    ScanSegment segment;
    segment.covariance = A.inverse();
    const Eigen::Vector2d d = segment.covariance * b;
    segment.rho = 3 + d(0);
    segment.theta = d(1);
    const Eigen::Vector2d n(std::cos(segment.theta), std::sin(segment.theta)), t(-n.y(), n.x());
    segment.start = segment.rho * n - 1 * t;
    segment.end = segment.rho * n + 1.9 * t;
    SegmentFactor f;
    f.start_body << segment.start, 0;
    f.end_body << segment.end, 0;
    f.sqrt_information = segment_sqrt_information(segment, NoiseFloor());
    Eigen::Vector2d r;
    SegmentTerm(f, {3, 0, 0})
        .evaluate(PoseState(SE3()), PlaneState(Plane(-Eigen::Vector3d::UnitX(), 0)), r, nullptr);
    return r;
  }));
}

TEST(SurfelMomentsFactor, PassesAllChecks) {
  Random random(9);
  const SE3 carrier(SO3::exp({0.1, 0.05, 1}), {2, 1, 0.1});
  const SE3 seeing(SO3::exp({-0.1, 0.2, 2}), {3, 1.5, 0.3});
  const SE3 T_body_cell(SO3::exp({0.05, 0.02, 0}), {1, 0.4, 0.02});
  const SE3 T_map_cell = carrier * T_body_cell;
  Moments moments;
  const Eigen::Vector3d surfel(0.01, 0.1, -0.05);
  for (int i = 0; i < 12; ++i) {
    const double x = random.uniform(-0.05, 0.05), y = random.uniform(-0.05, 0.05);
    const Eigen::Vector3d cell(x, y, surfel.x() + surfel.y() * x + surfel.z() * y);
    moments.add(seeing.inverse() * (T_map_cell * cell), 100);
  }
  const SurfelMomentsTerm term(moments, T_body_cell);
  const Cost cost(make_cost(term));
  const twins::SurfelMoments twin_term{term.root_weight, term.mean_body, term.rows, T_body_cell};
  const Cost twin(new ceres::AutoDiffCostFunction<twins::SurfelMoments, 4, 7, 7, 3>(
      new twins::SurfelMoments(twin_term)));
  const FactorTester tester(*cost, {&kPose, &kPose, nullptr});
  const Blocks truth{block(seeing), block(carrier), block(surfel)};
  EXPECT_TRUE(tester.is_zero(truth, 1e-6));
  FactorCheck check;
  check.autodiff_twin = twin.get();
  EXPECT_TRUE(tester.check_all({truth}, check));
  EXPECT_TRUE(tester.unchanged_when_moved(truth, [](const SE3& T, const Blocks& at) {
    return Blocks{block(T * pose_of(at[0])), block(T * pose_of(at[1])), at[2]};
  }));

  // The carrier's own view: the same formula with both poses alike.
  const SurfelMomentsOwnTerm own(moments, T_body_cell);
  const Cost own_cost(make_cost(own));
  const Cost own_twin(new ceres::AutoDiffCostFunction<twins::SurfelMomentsOwn, 4, 3>(
      new twins::SurfelMomentsOwn{{own.root_weight, own.mean_cell, own.rows_cell, SE3()}}));
  check.autodiff_twin = own_twin.get();
  EXPECT_TRUE(FactorTester(*own_cost, {nullptr}).check_all({{block(surfel)}}, check));
}

TEST(SurfelParentFactor, PassesAllChecks) {
  SurfelParentFactor f;
  f.sigma_height = 0.5;
  const SE3 carrier(SO3::exp({0.1, 0.05, 1}), {2, 1, 0.1});
  const SE3 T_body_cell(SO3::exp({0.05, 0.02, 0}), {1, 0.4, 0.02});
  const SE3 T_map_cell = carrier * T_body_cell;
  const Plane parent_cell(Eigen::Vector3d(0.1, -0.2, 1), 0.03);
  const PlaneLandmark parent = PlaneLandmark::at(T_map_cell * parent_cell, {2, 1, 0});
  const Cost cost(make_cost(SurfelParentTerm(f, T_body_cell, parent.anchor_map)));
  const Cost twin(new ceres::AutoDiffCostFunction<twins::SurfelParent, 3, 7, 4, 3>(
      new twins::SurfelParent{f, T_body_cell, parent.anchor_map}));
  const FactorTester tester(*cost, {&kPose, &kPlane, nullptr});
  const Eigen::Vector3d n = parent_cell.normal();
  const Eigen::Vector3d surfel(parent_cell.rho() / n.z(), -n.x() / n.z(), -n.y() / n.z());
  const Blocks truth{block(carrier), block(parent.plane_anchor), block(surfel)};
  EXPECT_TRUE(tester.is_zero(truth));
  FactorCheck check;
  check.autodiff_twin = twin.get();
  EXPECT_TRUE(tester.check_all({truth}, check));
}

}  // namespace
}  // namespace lamina
