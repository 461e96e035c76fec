// Manifolds against Ceres' own matchers and against the groups.
#include <ceres/manifold_test_utils.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lamina/backend/graph/states.hpp>
#include <lamina/backend/solver/ceres/manifolds.hpp>

#include "support/random.hpp"

namespace lamina {
namespace {

using namespace ceres;  // the matchers are named without their namespace

TEST(PoseManifold, HoldsCeresInvariants) {
  const PoseManifold manifold;
  test::Random random(1);
  for (const double scale : {0.0, 1e-5, 0.1, 1.0}) {
    for (int i = 0; i < 20; ++i) {
      ceres::Vector x(7), y(7);
      const PoseState a(random.pose(10));
      a.write(x.data());
      const ceres::Vector delta = random.normal_vector(6, 0.5 * scale);
      a.plus(random.normal_vector(6, 0.5)).write(y.data());
      EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y, 1e-8);
    }
  }
}

TEST(PoseManifold, PlusIsTimesExp) {
  test::Random random(2);
  const SE3 T = random.pose(10);
  const Vector6d d = random.normal_vector(6);
  double x[7], y[7];
  PoseState(T).write(x);
  PoseManifold().Plus(x, d.data(), y);
  EXPECT_LT(((T * SE3::exp(d)).inverse() * PoseState(y).se3()).log().norm(), 1e-12);
}

TEST(PlaneManifold, HoldsCeresInvariants) {
  const PlaneManifold manifold;
  test::Random random(3);
  std::vector<Plane> planes = {Plane(), Plane(-Eigen::Vector3d::UnitZ(), 1),
                               Plane(Eigen::Vector3d::UnitX(), 0), Plane({1, 0, -1e-12}, 2)};
  for (int i = 0; i < 20; ++i) planes.push_back(random.plane(10));
  for (const Plane& plane : planes) {
    for (const double scale : {0.0, 1e-5, 0.1, 1.0}) {
      ceres::Vector x(4), y(4);
      PlaneState(plane).write(x.data());
      PlaneState(plane.boxplus(random.normal3(0.5))).write(y.data());
      const ceres::Vector delta = random.normal3(0.5 * scale);
      EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y, 1e-8);
    }
  }
}

TEST(SubManifold, HoldsCeresInvariants) {
  const StateManifolds manifolds;
  test::Random random(5);
  for (int i = 0; i < 10; ++i) {
    const PoseState pose(random.pose(10));
    const PlaneState plane(random.plane(10));
    const auto check = [&](const SubManifold& manifold, const auto& state) {
      ceres::Vector x(manifold.AmbientSize()), y(manifold.AmbientSize());
      state.write(x.data());
      const ceres::Vector delta = random.normal_vector(manifold.TangentSize(), 0.2);
      manifold.Plus(x.data(), random.normal_vector(manifold.TangentSize(), 0.3).eval().data(),
                    y.data());
      EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y, 1e-8);
    };
    check(manifolds.pose_turn, pose);
    check(manifolds.pose_position, pose);
    check(manifolds.plane_turn, plane);
    check(manifolds.plane_distance, plane);
  }
}

}  // namespace
}  // namespace lamina
