// A scanner that sits elsewhere than it is said to, and a robot that travels and turns.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include <lamina/pipeline/calibration/mounting_error.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;

// Pieces of half a metre that turn by up to `turn` rad; wheels short by 3 % that drift and slip,
// some grossly; scans to a millimetre from a scanner said to sit `error` from where it sits.
MountingError drive(const SE3& error, int pieces, double turn, unsigned seed = 3) {
  MountingError result;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  for (int i = 0; i < pieces; ++i) {
    const double yaw = turn * std::sin(0.7 * i);
    const SE3 moved = SE3::planar(0.5 * std::cos(yaw / 2), 0.5 * std::sin(yaw / 2), yaw);
    const double slip = i % 20 == 7 ? 0.1 : 0.005, drifted = yaw + 0.01 + 0.003 * normal(random);
    PairedMotion piece;
    piece.way = 0.5;
    piece.stamp = Timestamp::from_seconds(1000 + i);
    piece.wheels = SE3::planar(0.485 * std::cos(drifted / 2) + slip * normal(random),
                               0.485 * std::sin(drifted / 2) + slip * normal(random), drifted);
    const SE3 noisy = moved * SE3::planar(0.001 * normal(random), 0.001 * normal(random), 0);
    piece.scans = error * noisy * error.inverse();
    result.add(piece);
  }
  return result;
}

TEST(MountingError, HeadingAndPlaceAreFoundTogether) {
  const MountingError error = drive(SE3::planar(0.02, -0.015, 2 * kDegree), 300, 0.5);
  const auto heading = error.heading();
  const auto place = error.place();
  ASSERT_TRUE(heading && place);
  EXPECT_TRUE(heading->adoption.adopted && place->adoption.adopted);
  EXPECT_LT(heading->sigma, 0.12 * kDegree);
  EXPECT_NEAR(heading->value, 2 * kDegree, 3.5 * heading->sigma);
  const Eigen::Vector2d off = place->value - Eigen::Vector2d(0.02, -0.015);
  EXPECT_LT(off.norm(), 0.005);
  EXPECT_LT(off.dot(place->covariance.inverse() * off), 13.8);
  EXPECT_LT(place->covariance.diagonal().cwiseSqrt().maxCoeff(), 0.003);
}

// Points are back where they are by what the evidence has, and the prior is not in it twice.
TEST(MountingError, EvidenceUndoesTheError) {
  const MountingError error = drive(SE3::planar(0.02, -0.015, 2 * kDegree), 300, 0.5);
  const MountingEvidence evidence = error.evidence();
  const Eigen::Vector3d e = evidence.information.ldlt().solve(evidence.pull);
  EXPECT_LT((e.head<2>() - Eigen::Vector2d(-0.02, 0.015)).norm(), 0.005);
  EXPECT_NEAR(e.z(), -2 * kDegree, 0.4 * kDegree);
  EXPECT_TRUE(drive(SE3(), 5, 0.5).evidence().information.isZero(0));
}

TEST(MountingError, IsNoneWhereThereIsNone) {
  int place_adopted = 0, heading_adopted = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const MountingError error = drive(SE3(), 150, 0.5, seed);
    const auto heading = error.heading();
    const auto place = error.place();
    ASSERT_TRUE(heading && place);
    place_adopted += place->adoption.adopted;
    heading_adopted += heading->adoption.adopted;
  }
  EXPECT_LE(place_adopted, 1);
  EXPECT_LE(heading_adopted, 1);
}

TEST(MountingError, StraightWaysTellTheHeadingAndNoPlace) {
  const MountingError error = drive(SE3::planar(0.02, 0, 2 * kDegree), 100, 0);
  EXPECT_FALSE(error.place());
  ASSERT_TRUE(error.heading());
  EXPECT_NEAR(error.heading()->value, 2 * kDegree, 3.5 * error.heading()->sigma);
}

// Wheels that slip sideways in a few stretches of a short way, all else quiet: chance, which way.
TEST(MountingError, AFewSlipsOfAShortWayAreNoHeading) {
  int adopted = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, 1);
    MountingError error;
    double slip = 0;
    for (int i = 0; i < 33; ++i) {
      if (i % 4 == 0) slip = 0.012 * normal(random);
      const double yaw = i % 4 == 3 ? 0.6 : 0.0;
      PairedMotion piece;
      piece.way = 0.5;
      piece.stamp = Timestamp::from_seconds(1000 + i);
      piece.scans = SE3::planar(0.5, 0, yaw);
      piece.wheels = SE3::planar(0.5 + 0.005 * normal(random), slip + 0.005 * normal(random),
                                 yaw * (1 + 0.05 * normal(random)));
      error.add(piece);
    }
    ASSERT_TRUE(error.heading());
    adopted += error.heading()->adoption.adopted;
  }
  EXPECT_LE(adopted, 1);
}

TEST(MountingError, FewPiecesTellNothing) {
  EXPECT_FALSE(drive(SE3::planar(0.02, 0, 2 * kDegree), 19, 0).heading());
  EXPECT_FALSE(drive(SE3::planar(0.02, 0, 0), 5, 0.5).place());
  EXPECT_FALSE(MountingError().heading());
  EXPECT_FALSE(MountingError().place());
}

}  // namespace
}  // namespace lamina
