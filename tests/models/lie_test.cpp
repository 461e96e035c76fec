// The Lie-group tester over rotations and rigid motions, and what is theirs alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <lamina/models/error.hpp>
#include <lamina/models/lie/se3.hpp>

#include "support/lie_tester.hpp"

namespace lamina::test {
namespace {

using Groups = testing::Types<SO3, SE3>;
INSTANTIATE_TYPED_TEST_SUITE_P(Lie, LieGroupTest, Groups);

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

TEST(SO3, ConstructorNormalises) {
  const SO3 R(Eigen::Quaterniond(0, 0, 0, 5));
  EXPECT_NEAR(R.quaternion().norm(), 1, 1e-15);
  EXPECT_THAT(R, IsNear(SO3::rot_z(M_PI), 1e-14));
}

TEST(SO3, BadInputIsAnError) {
  EXPECT_THROW(SO3(Eigen::Quaterniond(0, 0, 0, 0)), Error);
  EXPECT_THROW(SO3(Eigen::Quaterniond(kNaN, 0, 0, 1)), Error);
  EXPECT_THROW(SO3(Eigen::Quaterniond(kInf, 0, 0, 1)), Error);
  EXPECT_THROW(SO3::from_matrix(Eigen::Matrix3d::Zero()), Error);
  EXPECT_THROW(SO3::from_matrix(-Eigen::Matrix3d::Identity()), Error);
  EXPECT_THROW(SO3::from_matrix(Eigen::Matrix3d::Constant(kNaN)), Error);
}

TEST(SO3, FromMatrixIsTheNearestRotation) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const SO3 R = random.rotation();
    EXPECT_THAT(SO3::from_matrix(R.matrix()), IsNear(R, 1e-14));
    // R times a symmetric positive matrix near the unit matrix: polar decomposition gives R.
    Eigen::Matrix3d noise = 0.05 * Eigen::Matrix3d::NullaryExpr([&] { return random.normal(); });
    const Eigen::Matrix3d S = Eigen::Matrix3d::Identity() + 0.5 * (noise + noise.transpose());
    EXPECT_THAT(SO3::from_matrix(R.matrix() * S), IsNear(R, 1e-13));
  }
}

TEST(SO3, LogIsAtMostPi) {
  Random random(2);
  for (int i = 0; i < 200; ++i) EXPECT_LE(random.rotation().log().norm(), M_PI + 1e-15);
  // More than pi comes back from the other side.
  EXPECT_THAT(SO3::exp({0, 0, M_PI + 0.1}).log(),
              IsNear(Eigen::Vector3d(0, 0, -M_PI + 0.1), 1e-14));
}

TEST(SO3, LongChainsStayUnit) {
  SO3 R;
  const SO3 step = SO3::exp({1e-3, 2e-3, -3e-3});
  for (int i = 0; i < 100000; ++i) R = R * step;
  EXPECT_NEAR(R.quaternion().norm(), 1, 1e-15);
  EXPECT_THAT(R, IsNear(SO3::exp(1e5 * Eigen::Vector3d(1e-3, 2e-3, -3e-3)), 1e-10));
}

TEST(SO3, TurnsByHand) {
  EXPECT_THAT(SO3::rot_z(M_PI / 2) * Eigen::Vector3d::UnitX(),
              IsNear(Eigen::Vector3d(0, 1, 0), 1e-15));
  EXPECT_THAT(SO3::rot_x(M_PI / 2) * Eigen::Vector3d::UnitY(),
              IsNear(Eigen::Vector3d(0, 0, 1), 1e-15));
  EXPECT_THAT(SO3::rot_y(M_PI / 2) * Eigen::Vector3d::UnitZ(),
              IsNear(Eigen::Vector3d(1, 0, 0), 1e-15));
  EXPECT_NEAR(SO3::rot_z(2.5).yaw(), 2.5, 1e-15);
}

TEST(SE3, ByHand) {
  // One metre ahead, then a quarter turn left: x of the body is y of the map.
  const SE3 T_map_body = SE3::planar(1, 0, M_PI / 2);
  EXPECT_THAT(T_map_body * Eigen::Vector3d(2, 0, 0), IsNear(Eigen::Vector3d(1, 2, 0), 1e-15));
  EXPECT_THAT(T_map_body.inverse() * Eigen::Vector3d(1, 2, 0),
              IsNear(Eigen::Vector3d(2, 0, 0), 1e-15));
  // A screw: half a turn about z while rising 1 m, with the arc of radius 1 that ends 2 m away.
  const SE3 screw = SE3::exp((Vector6d() << M_PI, 0, 1, 0, 0, M_PI).finished());
  EXPECT_THAT(screw.translation(), IsNear(Eigen::Vector3d(0, 2, 1), 1e-14));
}

TEST(SE3, InterpolatesAlongTheGeodesic) {
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const SE3 a = random.pose(5), b = random.pose(5);
    EXPECT_THAT(SE3::interpolate(a, b, 0), IsNear(a, 1e-13));
    EXPECT_THAT(SE3::interpolate(a, b, 1), IsNear(b, 1e-12));
    const SE3 middle = SE3::interpolate(a, b, 0.5);
    EXPECT_THAT(a.inverse() * middle, IsNear(middle.inverse() * b, 1e-12));
  }
}

}  // namespace
}  // namespace lamina::test
