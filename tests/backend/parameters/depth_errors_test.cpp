// What a map tells of the depth camera it was made with.
#include <gtest/gtest.h>

#include <lamina/backend/parameters/depth_errors.hpp>
#include <lamina/backend/refine/refiner.hpp>

#include "backend/mapper/mapper_room.hpp"

namespace lamina {
namespace {

using namespace made_up;

const SE3 kOptical(SO3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)), {0.1, 0, 0.5});

DepthErrors::Matrix prior() {
  DepthErrors::Vector sigmas;
  sigmas << 0.03, 0.02, 0.01, 0.026, 0.03, 0.03, 0.01, 0.01, 0.02, 0.01, 0.01, 1e-6, 0.03;
  return sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
}

// Two laps of a room, seen by a camera that errs by `error`; wheels that drift.
Graph map_with(const DepthCameraError& error, unsigned seed) {
  Drive drive(240, 120, seed);
  for (SE3& T : drive.increments) T = corrected(T, -WheelErrors::of(0, 0.01, 0));
  const auto room = make_room();
  Sensor sensor(seed + 1);
  const DepthCameraError as_seen = error.inverse();
  const SE3 T_camera_body = kOptical.inverse();
  Mapper mapper = run(drive, {}, [&](std::size_t i) {
    Observations o = sensor.depth(drive.truth[i], at_frame(i), room);
    o.T_body_sensor = kOptical;
    for (PlaneObservation& plane : o.planes) {
      plane.plane_sensor = as_seen.corrected(T_camera_body * plane.plane_sensor);
      plane.moments_sensor = as_seen.corrected(plane.moments_sensor.transformed(T_camera_body));
      for (auto& corner : plane.outline_sensor) corner = as_seen.corrected(T_camera_body * corner);
    }
    return o;
  });
  mapper.refine();
  return mapper.graph();
}

TEST(DepthCameraError, PointsPlanesAndMomentsAgree) {
  const DepthCameraError error{{0.006, -0.004, 0.002}, 0.02};
  const Plane measured(Eigen::Vector3d(0.3, -0.2, -1).normalized(), -2.5);
  const Matrix32d B = measured.tangent_basis();
  Moments moments, of_corrected;
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d x =
        measured.rho() * measured.normal() + B * Eigen::Vector2d(0.1 * (i % 8), 0.1 * (i / 8));
    const Eigen::Vector3d straight = error.corrected(x);
    EXPECT_NEAR(1 / x.z() - 1 / straight.z(),
                error.e.dot(Eigen::Vector3d(x.x() / x.z(), x.y() / x.z(), 1)), 1e-12);
    EXPECT_NEAR(straight.x() / straight.z(), 1.02 * x.x() / x.z(), 1e-12);
    EXPECT_LT((error.inverse().corrected(straight) - x).norm(), 1e-12);
    EXPECT_NEAR(error.corrected(measured).signed_distance(straight), 0, 1e-12);
    moments.add(x, 1e4);
    of_corrected.add(straight, 1e4);
  }
  const Eigen::Vector3d eye = Eigen::Vector3d::Zero();
  const Plane a = error.corrected(moments).fit_plane(eye, 1.0)->plane;
  const Plane b = of_corrected.fit_plane(eye, 1.0)->plane;
  EXPECT_LT((a.normal() - b.normal()).norm(), 1e-6);
  EXPECT_NEAR(a.rho(), b.rho(), 1e-6);
}

TEST(DepthErrors, SlopesAreFoundWithinTheirSigmas) {
  const DepthCameraError error{{0.006, -0.004, 0}};
  const auto found =
      estimate_depth_errors(map_with(error, 41), kOptical, prior(), DepthErrors::Vector::Zero());
  ASSERT_TRUE(found);
  const Eigen::Vector3d off = found->camera().e - error.e;
  for (int k = 0; k < 2; ++k) {
    const double sigma = std::sqrt(found->covariance(9 + k, 9 + k));
    EXPECT_LT(sigma, 0.001) << k;
    EXPECT_LT(std::abs(off(k)), 3 * sigma + 0.3 * std::abs(error.e(k))) << k;  // one step
  }
  EXPECT_NEAR(found->wheels()(1), 0.01, 4 * std::sqrt(found->covariance(1, 1)));
  EXPECT_LT(std::abs(found->wheels()(3)), 4 * std::sqrt(found->covariance(3, 3)));
}

TEST(DepthErrors, AFocalLengthIsFoundBesideTurnsOfTheWheels) {
  const DepthCameraError error{Eigen::Vector3d::Zero(), 0.02};
  const auto found =
      estimate_depth_errors(map_with(error, 41), kOptical, prior(), DepthErrors::Vector::Zero());
  ASSERT_TRUE(found);
  const double sigma = std::sqrt(found->covariance(12, 12));
  EXPECT_LT(sigma, 0.003);
  EXPECT_NEAR(found->camera().focal, 0.02, 3 * sigma + 0.3 * 0.02);  // one step
}

TEST(DepthErrors, AGoodCameraIsLeftAlone) {
  for (const unsigned seed : {43U, 47U}) {
    const auto found =
        estimate_depth_errors(map_with({}, seed), kOptical, prior(), DepthErrors::Vector::Zero());
    ASSERT_TRUE(found);
    const Eigen::Vector2d slopes = found->camera().e.head<2>();
    const Eigen::Matrix2d covariance = found->covariance.block<2, 2>(9, 9);
    EXPECT_LT(slopes.dot(covariance.inverse() * slopes), 13.8);  // 99.9 %
    EXPECT_LT(std::abs(found->camera().focal), 3.3 * std::sqrt(found->covariance(12, 12)));
  }
}

TEST(DepthErrors, NothingToTellIsNothingTold) {
  EXPECT_FALSE(estimate_depth_errors({}, kOptical, prior(), DepthErrors::Vector::Zero()));
}

}  // namespace
}  // namespace lamina
