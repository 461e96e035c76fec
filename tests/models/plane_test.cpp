// Planes: poles, signs, S^2 x R, transforms.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <lamina/models/error.hpp>
#include <lamina/models/plane.hpp>

#include "support/matchers.hpp"
#include "support/random.hpp"

namespace lamina::test {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

// Planes at the edges of every parametrisation, then random ones.
std::vector<Plane> planes() {
  std::vector<Plane> all;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      for (const double rho : {0.0, -0.0, 1.0, -2.0, 5000.0}) {
        all.emplace_back(sign * Eigen::Vector3d::Unit(axis), rho);
      }
    }
  }
  for (const double tilt : {1e-300, 1e-16, 1e-12, 1e-8, 1e-4}) {
    all.emplace_back(Eigen::Vector3d(tilt, -tilt, 1), 0.5);
    all.emplace_back(Eigen::Vector3d(-tilt, tilt, -1), -0.5);
  }
  Random random(1);
  for (int i = 0; i < 50; ++i) all.push_back(random.plane(10));
  return all;
}

TEST(Plane, DefaultIsTheFloorSeenFromAbove) {
  EXPECT_EQ(Plane().normal(), Eigen::Vector3d::UnitZ());
  EXPECT_EQ(Plane().rho(), 0);
  EXPECT_GT(Plane().signed_distance({0, 0, 1}), 0);
}

TEST(Plane, ConstructorNormalisesBoth) {
  const Plane plane({0, 3, 4}, 10);
  EXPECT_THAT(plane.normal(), IsNear(Eigen::Vector3d(0, 0.6, 0.8), 1e-15));
  EXPECT_NEAR(plane.rho(), 2, 1e-15);
  EXPECT_NEAR(plane.normal().norm(), 1, 1e-15);
  // Also where squares leave the range of double.
  EXPECT_THAT(Plane({1e200, 0, 0}, 2e200), IsNear(Plane({1, 0, 0}, 2), 1e-15));
}

TEST(Plane, BadInput) {
  for (const Eigen::Vector3d& normal :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(kNaN, 0, 1), Eigen::Vector3d(0, kInf, 0)}) {
    EXPECT_THROW(Plane(normal, 1), Error);
    EXPECT_FALSE(Plane::from_normal_rho(normal, 1));
  }
  EXPECT_THROW(Plane({0, 0, 1}, kNaN), Error);
  EXPECT_FALSE(Plane::from_normal_rho({0, 0, 1}, kInf));
  EXPECT_FALSE(Plane::from_spherical(kNaN, 0, 0));
  EXPECT_FALSE(Plane::from_spherical(0, kInf, 0));
  EXPECT_FALSE(Plane::from_spherical(0, 0, kNaN));
}

TEST(Plane, SphericalAtThePoles) {
  const Plane up({0, 0, 1}, 0.3), down({0, 0, -1}, 0.3);
  EXPECT_EQ(up.theta(), 0);
  EXPECT_EQ(up.phi(), 0);
  EXPECT_EQ(down.theta(), M_PI);
  EXPECT_EQ(down.phi(), 0);
  EXPECT_THAT(*Plane::from_spherical(0.3, 0, 1.2), IsNear(up, 1e-15)) << "phi means nothing here";
  EXPECT_THAT(*Plane::from_spherical(0.3, M_PI, -2.0), IsNear(down, 1e-15));
}

TEST(Plane, SphericalRanges) {
  EXPECT_EQ(Plane({-1, 0, 0}, 0).phi(), M_PI);
  EXPECT_EQ(Plane({-1, -0.0, 0}, 0).phi(), M_PI) << "phi lies in (-pi, pi]";
  EXPECT_NEAR(Plane({0, -1, 0}, 0).phi(), -M_PI / 2, 1e-15);
  EXPECT_NEAR(Plane({1e-9, 0, 1}, 0).theta(), 1e-9, 1e-24) << "acos would give 0";
  for (const Plane& plane : planes()) {
    EXPECT_GE(plane.theta(), 0);
    EXPECT_LE(plane.theta(), M_PI);
    EXPECT_GT(plane.phi(), -M_PI);
    EXPECT_LE(plane.phi(), M_PI);
    EXPECT_THAT(*Plane::from_spherical(plane.rho(), plane.theta(), plane.phi()),
                IsNear(plane, 1e-12 * (1 + std::abs(plane.rho()))));
  }
}

TEST(Plane, AScannerInTheXyPlaneSeesRhoOverSinTheta) {
  const Plane plane = *Plane::from_spherical(2.0, 1.1, 0.7);
  const double distance = plane.rho() / std::sin(plane.theta());
  const Eigen::Vector3d foot(distance * std::cos(0.7), distance * std::sin(0.7), 0);
  EXPECT_NEAR(plane.signed_distance(foot), 0, 1e-15);
}

TEST(Plane, SignSaysWhereItWasSeenFrom) {
  const std::vector<Eigen::Vector3d> points{{1, 0, 2}, {0, 1, 2}, {-1, -1, 2}, {1, 1, 2}};
  const auto above = Plane::from_points(points, {0, 0, 5});
  const auto below = Plane::from_points(points, {0, 0, 0});
  ASSERT_TRUE(above && below);
  EXPECT_THAT(*above, IsNear(Plane({0, 0, 1}, 2), 1e-12));
  EXPECT_THAT(*below, IsNear(Plane({0, 0, -1}, -2), 1e-12));
  EXPECT_GT(above->signed_distance({0, 0, 5}), 0);
  EXPECT_GT(below->signed_distance({0, 0, 0}), 0);
  EXPECT_THAT(above->flipped(), IsNear(*below, 1e-12));
  EXPECT_THAT(above->flipped().flipped(), IsNear(*above, 0.0));
}

TEST(Plane, FewPointsOrPointsOnALineAreNoPlane) {
  const Eigen::Vector3d eye(0, 0, 5);
  EXPECT_FALSE(Plane::from_points({}, eye));
  const std::vector<Eigen::Vector3d> two{{0, 0, 0}, {1, 0, 0}};
  EXPECT_FALSE(Plane::from_points(two, eye));
  const std::vector<Eigen::Vector3d> line{{0, 0, 0}, {1, 2, 3}, {2, 4, 6}, {3, 6, 9}};
  EXPECT_FALSE(Plane::from_points(line, eye));
  const std::vector<Eigen::Vector3d> same(5, Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(Plane::from_points(same, eye));
  const std::vector<Eigen::Vector3d> one_bad{{0, 0, 0}, {1, 0, 0}, {kNaN, 1, 0}};
  EXPECT_FALSE(Plane::from_points(one_bad, eye)) << "two good ones are too few";
}

TEST(Plane, BasisIsRightHandedAndUnit) {
  for (const Plane& plane : planes()) {
    const Matrix32d B = plane.tangent_basis();
    EXPECT_NEAR(B.col(0).norm(), 1, 1e-14);
    EXPECT_THAT(Eigen::Vector3d(B.col(0).cross(B.col(1))), IsNear(plane.normal(), 1e-14));
  }
}

TEST(Plane, BoxplusOfBoxminusIsTheIdentity) {
  const std::vector<Plane> all = planes();
  for (const Plane& a : all) {
    EXPECT_THAT(Eigen::MatrixXd(a.boxminus(a)), IsNear(Eigen::MatrixXd::Zero(3, 1).eval(), 1e-15));
    for (const Plane& b : all) {
      const Plane back = a.boxplus(b.boxminus(a));
      EXPECT_THAT(back.normal(), IsNear(b.normal(), 1e-12));
      EXPECT_NEAR(back.rho(), b.rho(), 1e-12);
    }
  }
}

TEST(Plane, BoxminusOfBoxplusIsTheIdentity) {
  Random random(2);
  for (const Plane& a : planes()) {
    for (const double size : {1e-14, 1e-9, 1e-4, 0.1, 1.0, 3.0}) {
      Eigen::Vector3d d = random.normal3();
      d.head<2>() *= size / d.head<2>().norm();
      // Next to the opposite normal the direction of the tilt is ill-conditioned: 1 / (pi - size).
      EXPECT_THAT(Eigen::MatrixXd(a.boxplus(d).boxminus(a) - d).topRows(2).eval(),
                  IsNear(Eigen::MatrixXd::Zero(2, 1).eval(), 1e-14));
      EXPECT_NEAR(a.boxplus(d).boxminus(a).z(), d.z(), 1e-12);
    }
  }
}

TEST(Plane, OppositeNormalsAreHalfATurnApart) {
  for (const Plane& a : planes()) {
    const Plane opposite(-a.normal(), a.rho());
    EXPECT_NEAR(opposite.boxminus(a).head<2>().norm(), M_PI, 1e-12);
  }
}

TEST(Plane, BoxplusIsAGeodesicOfThatLength) {
  Random random(3);
  for (int i = 0; i < 50; ++i) {
    const Plane a = random.plane(1);
    const double length = random.uniform(0, 3);
    Eigen::Vector3d d(random.normal(), random.normal(), 0);
    d *= length / d.norm();
    EXPECT_NEAR(angle_between(a, a.boxplus(d)), length, 1e-13);
    EXPECT_NEAR(a.boxplus(d).normal().norm(), 1, 1e-15);
  }
  EXPECT_NEAR(angle_between(Plane(), Plane().boxplus({1e-12, 0, 0})), 1e-12, 1e-26);
}

TEST(Plane, TransformMovesItsPoints) {
  Random random(4);
  for (const Plane& plane_b : planes()) {
    const SE3 T_a_b = random.pose(10);
    const Plane plane_a = T_a_b * plane_b;
    const Eigen::Vector3d x_b = random.in_cube(5);
    EXPECT_NEAR(plane_a.signed_distance(T_a_b * x_b), plane_b.signed_distance(x_b),
                1e-12 * (1 + std::abs(plane_b.rho())));
    EXPECT_THAT(T_a_b.inverse() * plane_a, IsNear(plane_b, 1e-12 * (1 + std::abs(plane_b.rho()))));
  }
}

TEST(Plane, AboutAnAnchor) {
  Random random(5);
  for (const Plane& plane : planes()) {
    const Eigen::Vector3d anchor = random.in_cube(10), x = random.in_cube(10);
    const Plane moved = plane.about(anchor);
    EXPECT_NEAR(moved.signed_distance(x - anchor), plane.signed_distance(x),
                1e-13 * (10 + std::abs(plane.rho())));
    EXPECT_DOUBLE_EQ(moved.rho(), plane.rho_at(anchor));
    EXPECT_NEAR(plane.homogeneous().dot(x.homogeneous()), plane.signed_distance(x), 1e-11);
  }
}

TEST(Plane, FrameHasItsNormalAsZ) {
  Random random(6);
  for (const Plane& plane : planes()) {
    const Eigen::Vector3d origin = random.in_cube(3);
    const SE3 T_map_plane = plane_frame(plane, origin);
    EXPECT_THAT(T_map_plane * Plane(), IsNear(plane, 1e-12 * (1 + std::abs(plane.rho()))));
    EXPECT_NEAR((T_map_plane.translation() - plane.project(origin)).norm(), 0, 1e-15);
  }
}

}  // namespace
}  // namespace lamina::test
