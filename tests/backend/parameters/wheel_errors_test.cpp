// What a map tells of the wheels it was made with.
#include <gtest/gtest.h>

#include <lamina/backend/parameters/wheel_errors.hpp>
#include <lamina/backend/refine/refiner.hpp>

#include "backend/mapper/mapper_room.hpp"

namespace lamina {
namespace {

using namespace made_up;

WheelErrors::Matrix prior(const WheelErrors::Vector& sigmas = WheelErrors::of(0.03, 0.02, 0.01,
                                                                              0.026, 0.03, 0.03)) {
  return sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
}

// Two laps of a room; wheels whose increments must be corrected by `errors`.
Graph map_with(const WheelErrors::Vector& errors, unsigned seed) {
  Drive drive(240, 120, seed);
  for (SE3& T : drive.increments) T = corrected(T, -errors);
  const auto room = make_room();
  Sensor sensor(seed + 1);
  Mapper mapper = run(
      drive, {}, [&](std::size_t i) { return sensor.depth(drive.truth[i], at_frame(i), room); });
  mapper.refine();
  return mapper.graph();
}

TEST(WheelErrors, CorrectingAddsTurnsAndLengths) {
  const SE3 T = corrected(SE3::planar(2, 0, 0.1), WheelErrors::of(0.01, 0.05, 0.2, 0.03));
  const double turn = 0.05 * 2 + 0.2 * 0.1;
  EXPECT_NEAR(T.so3().yaw(), 0.1 + turn, 1e-12);
  EXPECT_NEAR(T.translation().norm(), 2.02, 1e-12);
  EXPECT_NEAR(std::atan2(T.translation().y(), T.translation().x()), turn / 2 + 0.03, 1e-12);
}

// A quarter turn on the spot carries a point before the wheels' middle to their left.
TEST(WheelErrors, CorrectingCarriesAPointOffTheMiddle) {
  const SE3 T = corrected(SE3::planar(0, 0, M_PI / 2), WheelErrors::of(0, 0, 0, 0, 0.3, 0.1));
  EXPECT_NEAR(T.translation().x(), -0.4, 1e-12);
  EXPECT_NEAR(T.translation().y(), 0.2, 1e-12);
  const SE3 at_place = SE3::planar(0.3, 0.1, 0), moved = SE3::planar(0.5, -0.2, 0.7);
  const SE3 of_point = at_place.inverse() * moved * at_place;
  const SE3 observed = corrected(moved, WheelErrors::of(0, 0, 0, 0, 0.3, 0.1));
  EXPECT_LT((observed.inverse() * of_point).log().norm(), 1e-12);
}

TEST(WheelErrors, AreFoundWithinTheirOwnSigmas) {
  const WheelErrors::Vector errors = WheelErrors::of(-0.03, 0.015, 0, 0.04, 0.05, -0.03);
  const auto found = estimate_wheel_errors(map_with(errors, 41), prior());
  ASSERT_TRUE(found);
  EXPECT_GT(found->significance(), 30);
  const WheelErrors::Vector off = found->value - errors;
  for (int k = 0; k < WheelErrors::kCount; ++k) {
    EXPECT_LT(std::abs(off(k)), 3 * std::sqrt(found->covariance(k, k))) << "error " << k;
  }
  EXPECT_LT(std::sqrt(found->covariance(0, 0)), 0.01);
  EXPECT_LT(std::sqrt(found->covariance(1, 1)), 0.005);
  EXPECT_LT(std::sqrt(found->covariance(3, 3)), 0.01);
  EXPECT_LT(std::sqrt(found->covariance(4, 4)), 0.015);
  EXPECT_LT(std::sqrt(found->covariance(5, 5)), 0.015);
}

TEST(WheelErrors, GoodWheelsAreLeftAlone) {
  double sum = 0;
  for (const unsigned seed : {43U, 47U}) {
    const auto found = estimate_wheel_errors(map_with(WheelErrors::Vector::Zero(), seed), prior());
    ASSERT_TRUE(found);
    sum += found->significance();
  }
  EXPECT_LT(sum, 23.0);  // 97 % of chi-squared with 12 degrees of freedom
}

// What was corrected already stands against the prior, too.
TEST(WheelErrors, ThePriorIsAboutAllThatIsCorrected) {
  const Graph graph = map_with(WheelErrors::Vector::Zero(), 53);
  const WheelErrors::Vector tight = WheelErrors::Vector::Constant(1e-6);
  const WheelErrors::Vector already = WheelErrors::of(0.01, -0.01, 0.005, 0.01, 0.01, -0.02);
  const auto found = estimate_wheel_errors(graph, prior(tight), already);
  ASSERT_TRUE(found);
  EXPECT_LT((found->value + already).norm(), 1e-5);
}

TEST(WheelErrors, NothingIsToldWithoutOdometry) {
  EXPECT_FALSE(estimate_wheel_errors(Graph(), prior()));
  Graph one;
  one.add_keyframe(Timestamp::from_seconds(0), SE3());
  EXPECT_FALSE(estimate_wheel_errors(one, prior()));
}

// 6 m straight ahead, then a wall is seen that nothing else tells of.
TEST(MovedByWheels, AWallSeenAfterTheWayIsOffByItsShare) {
  Graph graph;
  const SE3 T_step = SE3::planar(2, 0, 0);
  SE3 T_map_body;
  for (int i = 0; i < 4; ++i) {
    const KeyframeId id = graph.add_keyframe(Timestamp::from_seconds(i), T_map_body);
    if (i > 0)
      graph.odometry.push_back({KeyframeId(i - 1), id, T_step, 100 * Matrix6d::Identity()});
    T_map_body = T_map_body * T_step;
  }
  const Plane wall({-1, 0, 0}, -10);
  const PlaneId id = graph.add_plane(PlaneLandmark::at(wall, {10, 0, 1}));
  Moments seen;
  for (const double y : {-1, 0, 1}) {
    for (const double z : {0, 1, 2}) seen.add({4, y, z}, 1e4);
  }
  graph.plane_moments.push_back({graph.keyframes.back().id, id, seen});
  const MovedByWheels by_scale =
      moved_by_wheels(graph, Eigen::Vector3d(0.03 * 0.03, 0, 0).asDiagonal());
  ASSERT_EQ(by_scale.keyframes.size(), 4U);
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(std::sqrt(by_scale.keyframes[i](0, 0)), 0.03 * 2 * i, 1e-4) << i;
  EXPECT_NEAR(std::sqrt(by_scale.planes.at(id)(2, 2)), 0.18, 1e-3);
  EXPECT_NEAR(by_scale.planes.at(id).topLeftCorner(2, 2).trace(), 0, 1e-6);
  const MovedByWheels by_drift =
      moved_by_wheels(graph, Eigen::Vector3d(0, 0.01 * 0.01, 0).asDiagonal());
  EXPECT_NEAR(std::sqrt(by_drift.planes.at(id).topLeftCorner(2, 2).trace()), 0.06, 1e-3);
  EXPECT_TRUE(moved_by_wheels(Graph(), Eigen::Matrix3d::Identity()).planes.empty());
}

}  // namespace
}  // namespace lamina
