// A scanner's heading against the wheels' direction of travel.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <lamina/frontend/odometry/heading_error.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;

// A drive of `steps` of 10 cm in gentle curves; wheels that drift and shrink, scans with a
// millimetre of noise from a scanner whose heading is said to be off by `error`.
HeadingError drive(double error, int steps, double turn = 0.02) {
  HeadingError heading;
  std::mt19937 random(9);
  std::normal_distribution<double> noise(0, 0.001);
  const SE3 T_said_true = SE3::planar(0, 0, error);
  for (int i = 0; i < steps; ++i) {
    const double yaw = turn * std::sin(0.1 * i);
    const SE3 moved = SE3::planar(0.1 * std::cos(yaw / 2), 0.1 * std::sin(yaw / 2), yaw);
    const double drifted = yaw + 0.002;
    const SE3 wheels =
        SE3::planar(0.097 * std::cos(drifted / 2), 0.097 * std::sin(drifted / 2), drifted);
    const SE3 noisy = moved * SE3::planar(noise(random), noise(random), 0);
    heading.add(wheels, T_said_true * noisy * T_said_true.inverse());
  }
  return heading;
}

TEST(HeadingError, IsFoundWhateverTheWheelsDriftBy) {
  const auto found = drive(2 * kDegree, 400).result();
  ASSERT_TRUE(found);
  EXPECT_LT(found->sigma, 0.1 * kDegree);
  EXPECT_NEAR(found->value, -2 * kDegree, 3 * found->sigma);
}

TEST(HeadingError, IsNoneWhereThereIsNone) {
  const auto found = drive(0, 400).result();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->value, 0, 3 * found->sigma);
}

TEST(HeadingError, ShortWaysAndTurnsOnTheSpotTellNothing) {
  EXPECT_FALSE(drive(2 * kDegree, 90).result());
  EXPECT_FALSE(drive(2 * kDegree, 400, 0.5).result());
}

TEST(HeadingError, APieceEndsWhereOneOfThemIsSilent) {
  HeadingError heading;
  for (int i = 0; i < 400; ++i) {
    heading.add(SE3::planar(0.1, 0, 0),
                i % 4 == 3 ? std::nullopt : std::optional(SE3::planar(0.1, 0, 0)));
  }
  EXPECT_FALSE(heading.result());
}

}  // namespace
}  // namespace lamina
