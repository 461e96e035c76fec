// Planes moved by wrong mountings, against what their covariances say of it.
#include <gtest/gtest.h>

#include <lamina/backend/parameters/mounting_covariance.hpp>

namespace lamina {
namespace {

const SE3 kFirst(SO3::exp({0.05, -0.1, 0.7}), {1, -2, 0.3});
const Plane kPlane({-0.8, 0.55, 0.2}, -2.5);
const Eigen::Vector3d kCentroid = kPlane.project({4, 3, 1});

// One error at a time: the covariance is that of the plane's move.
TEST(ExtrinsicsUncertainty, IsHowThePlaneMoves) {
  for (int k = 0; k < 3; ++k) {
    constexpr double kSmall = 1e-6;
    Vector6d e = Vector6d::Zero();
    e(k == 2 ? 5 : k) = kSmall;
    const Plane moved = kFirst * SE3::exp(e) * kFirst.inverse() * kPlane;
    const Eigen::Vector3d d = moved.about(kCentroid).boxminus(kPlane.about(kCentroid)) / kSmall;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    covariance(k, k) = 1;
    const Eigen::Matrix3d C = by_mounting(covariance, kFirst, kPlane, kCentroid);
    EXPECT_TRUE(C.isApprox(d * d.transpose(), 1e-4)) << k << "\n" << C << "\n" << d.transpose();
  }
}

// What a heading does, a place may undo: cross terms count.
TEST(ExtrinsicsUncertainty, HeadingAboutTheCentroidLeavesTheDistance) {
  const Eigen::Vector3d p = kFirst.inverse() * kCentroid;
  const Eigen::Vector3d e(p.y(), -p.x(), 1);
  const Eigen::Matrix3d C = by_mounting(e * e.transpose(), kFirst, kPlane, kCentroid);
  EXPECT_NEAR(C(2, 2), 0, 1e-9);
  EXPECT_GT(C(0, 0) + C(1, 1), 0.9);
}

TEST(ExtrinsicsUncertainty, LevelGroundFeelsNone) {
  const Eigen::Matrix3d C = by_mounting(Eigen::Matrix3d::Identity(), SE3(), Plane(), {3, 4, 0});
  EXPECT_TRUE(C.isZero(1e-12)) << C;
}

}  // namespace
}  // namespace lamina
