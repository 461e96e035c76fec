// Where sensors sit, as states beside poses and planes: found within what is said of it, kept where
// nothing tells.
#include <gtest/gtest.h>

#include <lamina/backend/graph/factors/of_sensor.hpp>
#include <lamina/backend/parameters/extrinsics_estimation.hpp>

#include "backend/mapper/mapper_room.hpp"

namespace lamina {
namespace {

using namespace made_up;

constexpr double kDegree = M_PI / 180;
const SE3 kCamera(SO3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)), {0.1, 0, 0.5});
const SE3 kScanner = SE3::from_translation({0, 0, 0.5});

// By what is stated of a sensor, where it sits: 2 cm and 1.5 degrees off in all.
SE3 off(const SE3& T_body_sensor, double share) {
  Vector6d d;
  d << 0.012, -0.012, 0.01, 0.8 * kDegree, -0.9 * kDegree, 0.9 * kDegree;
  return T_body_sensor * SE3::exp(share * d);
}

// Laps of a room with wheels, and a camera that sits at kCamera and is stated elsewhere; every
// second frame is a scan, if `stated_scanner` is there.
Mapper room_map(unsigned seed, const SE3& stated_camera,
                const std::optional<SE3>& stated_scanner = {},
                const std::vector<Panel>& room = make_room()) {
  const Drive drive(120, 120, seed);
  Sensor sensor(seed + 1);
  const SE3 T_camera_body = kCamera.inverse();
  Mapper mapper = run(drive, {}, [&](std::size_t i) {
    if (stated_scanner && i % 2 == 1) {
      Observations o = sensor.scan(drive.truth[i], at_frame(i), room);
      o.T_body_sensor = *stated_scanner;
      o.first_floor_map = Plane(Eigen::Vector3d::UnitZ(), 0);
      return o;
    }
    Observations o = sensor.depth(drive.truth[i], at_frame(i), room);
    o.T_body_sensor = stated_camera;
    o.first_floor_map = Plane(Eigen::Vector3d::UnitZ(), 0);
    for (PlaneObservation& plane : o.planes) {
      plane.plane_sensor = T_camera_body * plane.plane_sensor;
      plane.moments_sensor = plane.moments_sensor.transformed(T_camera_body);
      for (auto& corner : plane.outline_sensor) corner = T_camera_body * corner;
    }
    return o;
  });
  RefineOptions quick;
  quick.thorough = false;
  mapper.refine(quick);
  return mapper;
}

double misfit(const FoundExtrinsics& found, const SE3& truth) {
  const Vector6d d = (found.found.inverse() * truth).log();
  return d.dot(found.covariance.ldlt().solve(d));
}

TEST(ExtrinsicsEstimation, AMountingIsFoundWithinItsSigmas) {
  int within = 0;  // 95 % of six
  for (const unsigned seed : {21U, 22U, 23U}) {
    const SE3 stated = off(kCamera, 1);
    const auto found = room_map(seed, stated).estimate_extrinsics({});
    ASSERT_TRUE(found);
    EXPECT_TRUE(found->adopted) << found->total_stated << " " << found->total_free;
    ASSERT_EQ(found->sensors.size(), 1U);
    EXPECT_EQ(found->sensors[0].sensor, "depth_camera");
    within += misfit(found->sensors[0], kCamera) < 12.6;
  }
  EXPECT_GE(within, 2);
}

TEST(ExtrinsicsEstimation, AnExactMountingIsKept) {
  for (const unsigned seed : {31U, 32U}) {
    const auto found = room_map(seed, kCamera, kScanner).estimate_extrinsics({});
    ASSERT_TRUE(found);
    EXPECT_FALSE(found->adopted) << found->total_stated << " " << found->total_free;
  }
}

TEST(ExtrinsicsEstimation, ACameraIsRelatedToAScannerThatSeesTheSameWalls) {
  const auto found = room_map(41, off(kCamera, 1), kScanner).estimate_extrinsics({});
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->adopted);
  ASSERT_EQ(found->sensors.size(), 2U);
  const SE3 between = found->sensors[1].found.inverse() * found->sensors[0].found;
  const Vector6d left = (between.inverse() * kScanner.inverse() * kCamera).log();
  EXPECT_LT(left.head<3>().norm(), 0.01);
  EXPECT_LT(left.tail<3>().norm(), 0.5 * kDegree);
  // Lines of a level scanner tell nothing of its height, roll and pitch.
  const FoundExtrinsics& scanner = found->sensors[1];
  EXPECT_LE(scanner.observed, 3);
  const Vector6d moved = (kScanner.inverse() * scanner.found).log();
  EXPECT_LT(moved.segment<3>(2).norm(), 1e-3);
}

TEST(ExtrinsicsEstimation, WhatAFloorDoesNotTellStays) {
  const std::vector<Panel> floor = {make_room().front()};
  const auto found = room_map(51, off(kCamera, 1), {}, floor).estimate_extrinsics({});
  ASSERT_TRUE(found);
  const FoundExtrinsics& camera = found->sensors[0];
  EXPECT_EQ(camera.observed, 3);
  // In body axes: moved along x and y, and turned about z by nothing; the rest is put right.
  const SO3 turned = camera.found.so3() * camera.stated.so3().inverse();
  EXPECT_LT(std::abs(turned.log().z()), 0.05 * kDegree);
  EXPECT_LT((camera.found.translation() - camera.stated.translation()).head<2>().norm(), 1e-3);
  const SO3 left = camera.found.so3() * kCamera.so3().inverse();
  EXPECT_LT(left.log().head<2>().norm(), 0.2 * kDegree);
  EXPECT_NEAR(camera.found.translation().z(), kCamera.translation().z(), 0.004);
}

TEST(ExtrinsicsEstimation, BothEnginesFindTheSame) {
  const Mapper mapper = room_map(61, off(kCamera, 0.5), off(kScanner, 0.3));
  ExtrinsicsOptions options;
  const auto native = mapper.estimate_extrinsics(options);
  options.engine = SolverEngine::kCeres;
  const auto ceres = mapper.estimate_extrinsics(options);
  ASSERT_TRUE(native && ceres);
  const Eigen::VectorXd sigma = native->covariance.diagonal().cwiseSqrt();
  EXPECT_LT((native->value - ceres->value).cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 0.1);
  EXPECT_NEAR(native->total_free / ceres->total_free, 1, 1e-4);
}

TEST(ExtrinsicsEstimation, FactorsMadeAnewCostTheSame) {
  Graph graph = room_map(71, off(kCamera, 1), kScanner).graph();
  graph.odometry[5].extrinsics = graph.extrinsics[0].id;
  graph.extrinsics[0].state = off(graph.extrinsics[0].state, -1);
  const double before = total(make_engine(graph, SolverEngine::kNative)->cost());
  EXPECT_NEAR(total(make_engine(graph, SolverEngine::kCeres)->cost()) / before, 1, 1e-9);
  make_factors_anew(graph);
  EXPECT_TRUE(graph.extrinsics[0].held_as_made());
  EXPECT_NEAR(total(make_engine(graph, SolverEngine::kNative)->cost()) / before, 1, 1e-9);
}

TEST(ExtrinsicsEstimation, NothingSeenIsNothingSaid) {
  EXPECT_FALSE(estimate_extrinsics({}, {}));
  EXPECT_FALSE(Mapper().estimate_extrinsics({}));
}

}  // namespace
}  // namespace lamina
