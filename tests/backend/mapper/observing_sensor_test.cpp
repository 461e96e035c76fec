// Sensors told by kind and place; what a map holds, moved with them.
#include <gtest/gtest.h>

#include <lamina/backend/mapper/observing_sensor.hpp>
#include <lamina/backend/solver/engine.hpp>

#include "backend/mapper/mapper_room.hpp"

namespace lamina {
namespace {

using namespace made_up;

Observations seen_from(SensorKind kind, const SE3& T_body_sensor) {
  Observations o;
  o.sensor = kind;
  o.T_body_sensor = T_body_sensor;
  o.planes.emplace_back();
  return o;
}

TEST(ObservingSensor, IsOneOfAKindAndPlace) {
  Graph graph;
  const ExtrinsicsId camera =
      observing_sensor(seen_from(SensorKind::kDepth, SE3::planar(0.1, 0, 0)), graph);
  EXPECT_EQ(graph.at(camera).sensor, "depth_camera");
  // Self-calibration moves a mounting by little; another camera sits elsewhere.
  const auto of = [&graph](SensorKind kind, const SE3& T) {
    return observing_sensor(seen_from(kind, T), graph);
  };
  EXPECT_EQ(of(SensorKind::kDepth, SE3::planar(0.12, 0, 0.05)), camera);
  EXPECT_NE(of(SensorKind::kDepth, SE3::planar(-0.1, 0, 0)), camera);
  EXPECT_NE(of(SensorKind::kStereo, SE3::planar(0.1, 0, 0)), camera);
  EXPECT_EQ(graph.extrinsics.size(), 3U);
  Observations none;
  EXPECT_EQ(observing_sensor(none, graph), ExtrinsicsId::kNone);
  EXPECT_EQ(of(SensorKind::kLidar, SE3::planar(std::nan(""), 0, 0)), ExtrinsicsId::kNone);
  EXPECT_EQ(graph.extrinsics.size(), 3U);
}

TEST(ObservingSensor, WhatTwoSensorsSawOfAPlaneIsKeptApart) {
  const Drive drive(40, 120, 5);
  Sensor sensor(6);
  const auto room = make_room();
  const Mapper mapper = run(drive, {}, [&](std::size_t i) {
    return i % 2 ? sensor.scan(drive.truth[i], at_frame(i), room)
                 : sensor.depth(drive.truth[i], at_frame(i), room);
  });
  int both = 0;
  for (const PlaneMomentsFactor& f : mapper.graph().plane_moments) {
    if (f.by_sensor.empty()) {
      EXPECT_NE(f.extrinsics, ExtrinsicsId::kNone);
      continue;
    }
    ++both;
    ASSERT_EQ(f.by_sensor.size(), 2U);
    Moments sum = f.by_sensor[0].moments_body;
    sum.merge(f.by_sensor[1].moments_body);
    EXPECT_EQ(sum.mean(), f.moments_body.mean());
    EXPECT_EQ(sum.scatter(), f.moments_body.scatter());
  }
  EXPECT_GT(both, 5);
}

TEST(ObservingSensor, MountingMovesWhatItsSensorSaw) {
  const Drive drive(40, 120, 7);
  Sensor sensor(8);
  const auto room = make_room();
  MapState map = run(drive, {}, [&](std::size_t i) {
                   return i % 2 ? sensor.scan(drive.truth[i], at_frame(i), room)
                                : sensor.depth(drive.truth[i], at_frame(i), room);
                 }).state();
  const MapState before = map;
  const SE3 C(SO3::rot_z(0.02), {0.01, 0, 0});
  const auto camera = std::find_if(map.graph.extrinsics.begin(), map.graph.extrinsics.end(),
                                   [](const auto& e) { return e.sensor == "depth_camera"; });
  ASSERT_NE(camera, map.graph.extrinsics.end());
  FoundExtrinsics found{camera->id, camera->sensor, camera->prior, C * camera->prior};
  const SensorMotions moved = mount(map, {found});
  EXPECT_LT((moved.of_images.log() - C.log()).norm(), 1e-12);
  EXPECT_LT(moved.of_scans.log().norm(), 1e-12);
  EXPECT_TRUE(map.problems().empty());
  for (std::size_t i = 0; i < map.graph.plane_moments.size(); ++i) {
    const PlaneMomentsFactor& a = before.graph.plane_moments[i];
    const PlaneMomentsFactor& b = map.graph.plane_moments[i];
    const bool of_camera = a.extrinsics == found.id;
    if (!a.by_sensor.empty()) continue;
    const Eigen::Vector3d expected =
        of_camera ? Eigen::Vector3d(C * a.moments_body.mean()) : a.moments_body.mean();
    EXPECT_LT((b.moments_body.mean() - expected).norm(), 1e-9);
  }
  for (const auto& [id, pieces] : map.outlines) {
    const auto& were = before.outlines.at(id);
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const bool area = pieces[i].points_body.size() > 2;
      const Eigen::Vector3d& was = were[i].points_body.front();
      EXPECT_LT((pieces[i].points_body.front() - (area ? C * was : was)).norm(), 1e-12);
    }
  }
}

}  // namespace
}  // namespace lamina
