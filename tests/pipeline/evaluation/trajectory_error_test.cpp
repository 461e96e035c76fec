// ATE and RPE on paths whose errors are known.
#include <gtest/gtest.h>

#include <lamina/pipeline/evaluation/trajectory_error.hpp>

namespace lamina {
namespace {

Trajectory wavy(const SE3& T_left, double wobble) {
  Trajectory path;
  for (int i = 0; i < 100; ++i) {
    const double t = 0.1 * i;
    const SE3 pose = SE3::planar(t + (i % 2 ? wobble : -wobble), std::sin(t), 0.3 * t);
    path.add(Timestamp::from_seconds(t), T_left * pose);
  }
  return path;
}

TEST(TrajectoryError, IsZeroForAMovedCopyOnceAligned) {
  const SE3 moved(SO3::exp({0.1, -0.2, 2.0}), {5, -3, 1});
  const auto error = trajectory_error(wavy(moved, 0), wavy(SE3(), 0));
  ASSERT_TRUE(error);
  EXPECT_EQ(error->matched, 100);
  EXPECT_LT(error->ate_m.rmse, 1e-9);
  EXPECT_LT(error->ate_deg.rmse, 1e-6);
  EXPECT_LT(error->rpe_m.rmse, 1e-9);
  EXPECT_LT(error->ate_first_m.rmse, 1e-9);
  EXPECT_GT(error->ate_unaligned_m.rmse, 1.0);
}

TEST(TrajectoryError, MeasuresAKnownWobble) {
  const auto error = trajectory_error(wavy(SE3(), 0.05), wavy(SE3(), 0));
  ASSERT_TRUE(error);
  EXPECT_NEAR(error->ate_m.rmse, 0.05, 1e-3);
  EXPECT_NEAR(error->ate_unaligned_m.rmse, 0.05, 1e-9);
  EXPECT_NEAR(error->ate_unaligned_m.max, 0.05, 1e-9);
}

// Millimetres beside a straight path say nothing of the turn about it.
TEST(TrajectoryError, AStraightPathIsAlignedByAttitudes) {
  Trajectory reference, estimate;
  for (int i = 0; i < 100; ++i) {
    const Timestamp t = Timestamp::from_seconds(0.1 * i);
    reference.add(t, SE3::planar(0.05 * i, 0.001 * (i % 3), 0));
    estimate.add(t, SE3(SO3::rot_x(0.002), {0.05 * i, -0.001 * (i % 3), 0.001 * (i % 2)}));
  }
  const auto error = trajectory_error(estimate, reference);
  ASSERT_TRUE(error);
  EXPECT_LT(error->ate_deg.max, 1);
  EXPECT_LT(error->T_reference_estimate.so3().log().norm(), 0.01);
  EXPECT_LT(error->ate_m.rmse, 0.003);
}

TEST(TrajectoryError, NeedsTwoStampsThatMeet) {
  Trajectory one;
  one.add(Timestamp::from_seconds(1000), SE3());
  EXPECT_FALSE(trajectory_error(one, wavy(SE3(), 0)));
  EXPECT_FALSE(trajectory_error(Trajectory(), wavy(SE3(), 0)));
}

}  // namespace
}  // namespace lamina
