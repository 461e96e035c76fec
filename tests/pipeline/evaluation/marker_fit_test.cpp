// A marker off the body's origin, by a clock that is late.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/pipeline/evaluation/marker_fit.hpp>
#include <lamina/pipeline/evaluation/trajectory_error.hpp>

namespace lamina {
namespace {

// A robot that curves about on a floor.
SE3 body_at(double t) {
  const double yaw = 0.8 * std::sin(0.5 * t) + 0.2 * t;
  return SE3(SO3::rot_z(yaw), {std::sin(0.4 * t) * 2, t * 0.1 + std::cos(0.6 * t), 0});
}

TEST(MarkerFit, FindsWhereTheMarkerSitsAndItsClock) {
  const SE3 T_reference_map(SO3::rot_z(1.1), {5, -3, 0.7});
  const Eigen::Vector3d lever(0.21, -0.08, 0);
  const double late = 0.137;
  Trajectory estimate, reference;
  for (double t = 1; t < 40; t += 0.1) estimate.add(Timestamp::from_seconds(t), body_at(t));
  for (double t = 0; t < 42; t += 0.01) {
    const SE3 body = T_reference_map * body_at(t);
    reference.add(Timestamp::from_seconds(t + late), SE3(SO3(), body * lever));
  }
  const auto fit = fit_marker(estimate, reference, {true, true});
  ASSERT_TRUE(fit);
  EXPECT_LT((fit->lever_body - lever).norm(), 1e-3);
  EXPECT_NEAR(fit->clock_s, late, 1e-3);
  const auto error = trajectory_error(fit->of_marker(estimate), reference);
  ASSERT_TRUE(error);
  EXPECT_LT(error->ate_m.rmse, 1e-3);
  const auto clock_alone = fit_marker(estimate, reference, {false, true});
  ASSERT_TRUE(clock_alone);
  EXPECT_EQ(clock_alone->lever_body.norm(), 0);
  EXPECT_GT(trajectory_error(clock_alone->of_marker(estimate), reference)->ate_m.rmse, 0.05);
}

TEST(MarkerFit, NothingToFit) {
  Trajectory estimate, reference;
  estimate.add(Timestamp::from_seconds(1), SE3());
  reference.add(Timestamp::from_seconds(100), SE3());
  EXPECT_FALSE(fit_marker(estimate, reference, {true, true}));
}

}  // namespace
}  // namespace lamina
