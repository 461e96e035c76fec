// Lines of scanners that lean on the body.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/backend/association/plane_evidence.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kHeight = 0.4;  // m

SE3 mounted(double roll_deg) {
  return SE3(SO3::exp(Eigen::Vector3d(roll_deg * kDegree, 0, 0)), {0.1, 0, kHeight});
}

// A wall on the left, 2 m of it, `distance` from the scanner in its own plane.
SegmentObservation wall(double distance) {
  SegmentObservation seen;
  ScanSegment& s = seen.segment;
  s.rho = distance;
  s.theta = M_PI / 2;
  s.start = {1, distance};
  s.end = {-1, distance};
  for (int i = 0; i <= 20; ++i) s.moments.add({1 - 0.1 * i, distance, 0}, 1e4);
  return seen;
}

TEST(PlaneEvidence, ALevelScannersLeanIsNoLever) {
  const SE3 T_body_lidar = mounted(2);
  PlaneEvidence all = make_evidence(wall(1), T_body_lidar);
  for (const double distance : {1.0, 10.0}) {
    const PlaneEvidence e = make_evidence(wall(distance), T_body_lidar);
    EXPECT_EQ(e.plane_body.normal().z(), 0);
    EXPECT_LT((e.plane_body.normal() - Eigen::Vector3d(0, -1, 0)).norm(), 1e-12);
    EXPECT_NEAR(e.plane_body.rho(), -distance * std::cos(2 * kDegree), 1e-12);
    EXPECT_EQ(e.moments_body.mean().z(), kHeight);
    EXPECT_LT(e.moments_body.cost(e.plane_body), 1e-12);
    EXPECT_EQ(e.scan_normal_body, Eigen::Vector3d(0, 0, 1));
    EXPECT_NEAR(e.outline_body[0].z(), kHeight + distance * std::sin(2 * kDegree), 1e-12);
    all.join(e);
  }
  // Seen from near and from far: still nothing of how it leans.
  EXPECT_EQ(all.moments_body.scatter()(2, 2), 0);
}

// A body that drives up a ramp: what its scanner sees is as upright as on level ground, and stands
// where it stands.
TEST(PlaneEvidence, OnARampWallsAreUpright) {
  const SE3 T_map_body(SO3::exp(Eigen::Vector3d(0.03, -0.09, 0)), {4, 1, 0.3});
  const SE3 T_body_lidar = mounted(0);
  const SE3 T_lidar_map = (T_map_body * T_body_lidar).inverse();
  const Plane wall_map({0, -1, 0}, -3);  // y = 3
  SegmentObservation seen;
  const Plane wall_lidar = T_lidar_map * wall_map;
  const Eigen::Vector2d across =
      wall_lidar.normal().head<2>() / wall_lidar.normal().head<2>().norm();
  const double rho = wall_lidar.rho() / wall_lidar.normal().head<2>().norm();
  const Eigen::Vector2d foot = rho * across, along(-across.y(), across.x());
  for (int i = -10; i <= 10; ++i) {
    const Eigen::Vector2d p = foot + 0.2 * i * along;
    seen.segment.moments.add({p.x(), p.y(), 0}, 1e4);
  }
  seen.segment.start = foot - 2 * along;
  seen.segment.end = foot + 2 * along;
  seen.segment.rho = std::abs(rho);
  seen.segment.theta = std::atan2(foot.y(), foot.x());
  const Eigen::Vector3d up_body = T_map_body.so3().inverse() * Eigen::Vector3d::UnitZ();
  const PlaneEvidence e = make_evidence(seen, T_body_lidar, up_body);
  const Plane there = T_map_body * e.plane_body;
  EXPECT_LT((there.normal() - wall_map.normal()).norm(), 1e-9);
  EXPECT_NEAR(there.rho(), wall_map.rho(), 1e-9);
  EXPECT_LT(e.moments_body.cost(e.plane_body), 1e-9);
  EXPECT_LT((e.scan_normal_body - up_body).norm(), 1e-12);
  for (const Eigen::Vector3d& p : e.outline_body)  // at the heights where it was seen
    EXPECT_NEAR((T_body_lidar.inverse() * p).z(), 0, 1e-12);
  // Taken for level it leans by what the body leans across it.
  const Plane level = T_map_body * make_evidence(seen, T_body_lidar).plane_body;
  EXPECT_GT(std::abs(level.normal().z()), 0.02);
}

TEST(PlaneEvidence, UpsideDownStaysUpsideDown) {
  const PlaneEvidence e = make_evidence(wall(3), mounted(178));
  EXPECT_EQ(e.scan_normal_body, Eigen::Vector3d(0, 0, -1));
  EXPECT_LT((e.plane_body.normal() - Eigen::Vector3d(0, 1, 0)).norm(), 1e-12);
}

TEST(PlaneEvidence, AScannerThatLooksUpSeesPlanesAsTheyLie) {
  const PlaneEvidence e = make_evidence(wall(10), mounted(45));
  EXPECT_NEAR(e.plane_body.normal().z(), -std::sin(45 * kDegree), 1e-12);
  EXPECT_NEAR(e.moments_body.mean().z(), kHeight + 10 * std::sin(45 * kDegree), 1e-12);
}

// By its end points a segment is as unsure as its fit says, ends included; its line is the same.
TEST(PlaneEvidence, EndPointsCountAsTheFitSays) {
  SegmentObservation seen = wall(3);
  seen.segment.covariance << 4e-4, 0, 0, 1e-4;  // at the foot, which is the middle
  for (const double roll_deg : {2.0, 45.0}) {
    const SE3 T_body_lidar = mounted(roll_deg);
    const PlaneEvidence e =
        make_evidence(seen, T_body_lidar, Eigen::Vector3d::UnitZ(), PartialView::kEndPoints);
    const PlaneEvidence returns = make_evidence(seen, T_body_lidar);
    EXPECT_NEAR(e.moments_body.weight(), 1 / 4e-4, 1e-6);
    EXPECT_NEAR(e.moments_body.scatter().trace(), 1 / 1e-4, 1e-4);
    EXPECT_NEAR(returns.moments_body.weight(), 21e4, 1e-4);
    EXPECT_LT(e.moments_body.cost(e.plane_body), 1e-9);
    EXPECT_LT((e.moments_body.mean() - returns.moments_body.mean()).norm(), 1e-9);
    EXPECT_TRUE(e.partial);
  }
}

}  // namespace
}  // namespace lamina
