// Lines of scanners that lean on the body.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/backend/plane_evidence.hpp>

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

}  // namespace
}  // namespace lamina
