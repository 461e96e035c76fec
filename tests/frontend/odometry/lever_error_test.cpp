// A scanner that sits elsewhere than it is said to, and a robot that turns.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include <lamina/frontend/odometry/lever_error.hpp>

namespace lamina {
namespace {

// Steps of 5 cm and up to `turn` rad; wheels short by 3 % that drift and slip, some pieces grossly;
// scans to a millimetre from a scanner said to sit `error` from where it sits.
LeverError drive(const SE3& error, int steps, double turn, unsigned seed = 3) {
  LeverError lever;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  for (int i = 0; i < steps; ++i) {
    const double yaw = turn * std::sin(0.1 * i);
    const SE3 moved = SE3::planar(0.05, 0, yaw);
    const double slip = i % 100 < 5 ? 0.05 : 0.003;
    const SE3 wheels = SE3::planar(0.0485 + slip * normal(random), slip * normal(random),
                                   yaw + 0.001 + 0.003 * normal(random));
    const SE3 noisy = moved * SE3::planar(0.001 * normal(random), 0.001 * normal(random), 0);
    lever.add(wheels, error * noisy * error.inverse());
  }
  return lever;
}

TEST(LeverError, IsFoundByTurns) {
  const auto found = drive(SE3::planar(0.02, -0.015, 0.01), 2000, 0.1).result();
  ASSERT_TRUE(found);
  const Eigen::Vector2d off = found->value - Eigen::Vector2d(0.02, -0.015);
  EXPECT_LT(off.norm(), 0.005);
  EXPECT_LT(off.dot(found->covariance.inverse() * off), 13.8);
  EXPECT_LT(found->covariance.diagonal().cwiseSqrt().maxCoeff(), 0.003);
}

TEST(LeverError, IsNoneWhereThereIsNone) {
  int stands_out = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto found = drive(SE3(), 1000, 0.1, seed).result();
    ASSERT_TRUE(found);
    stands_out += found->value.dot(found->covariance.inverse() * found->value) > 13.8;
  }
  EXPECT_LE(stands_out, 1);
}

TEST(LeverError, StraightWaysAndShortOnesTellNothing) {
  EXPECT_FALSE(drive(SE3::planar(0.02, 0, 0), 2000, 0.002).result());
  EXPECT_FALSE(drive(SE3::planar(0.02, 0, 0), 60, 0.1).result());
}

TEST(LeverError, APieceEndsWhereOneOfThemIsSilent) {
  LeverError lever;
  for (int i = 0; i < 2000; ++i) {
    lever.add(SE3::planar(0, 0, 0.1),
              i % 4 == 3 ? std::nullopt : std::optional(SE3::planar(0, 0, 0.1)));
  }
  EXPECT_FALSE(lever.result());
}

}  // namespace
}  // namespace lamina
