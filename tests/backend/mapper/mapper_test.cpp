// The mapper in a made-up building: every wall once, poses better than odometry, nothing throws.
#include <lamina/backend/mapper/mapper.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include <lamina/backend/solver/covariance.hpp>
#include <lamina/models/error.hpp>

#include "backend/mapper/mapper_room.hpp"

namespace lamina {
namespace {

using namespace made_up;  // NOLINT

TEST(Mapper, DepthLapsOfARoomFindEverySurfaceOnce) {
  const Drive drive(360, 180, 1);
  const auto room = make_room();
  Sensor sensor(2);
  Mapper mapper = run(
      drive, {}, [&](std::size_t i) { return sensor.depth(drive.truth[i], at_frame(i), room); });
  EXPECT_TRUE(mapper.graph().problems().empty());
  const PlanarMap map = mapper.map();
  ASSERT_EQ(map.trajectory.size(), drive.truth.size());
  SE3 dead = drive.truth[0];
  Trajectory odometry;
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    if (i > 0) dead = dead * drive.increments[i - 1];
    odometry.add(at_frame(i), dead);
  }
  EXPECT_LT(ate(map.trajectory, drive.truth), 0.02);
  EXPECT_LT(ate(map.trajectory, drive.truth), 0.5 * ate(odometry, drive.truth));
  EXPECT_LT(ate(mapper.online_trajectory(), drive.truth), 0.02);
  EXPECT_EQ(map.planes.size(), room.size());
  int floors = 0, walls = 0;
  for (const auto& plane : map.planes) {
    floors += plane.label == PlaneLabel::kFloor;
    walls += plane.label == PlaneLabel::kWall;
    EXPECT_EQ(plane.unobserved_directions, 0);
    EXPECT_GT(plane.area, 0.3);
    double nearest = 1e9;
    for (const auto& panel : room) {
      if (angle_between(panel.plane, plane.plane_map) > 0.02) continue;
      nearest = std::min(nearest, std::abs(panel.plane.signed_distance(plane.centroid_map)));
    }
    EXPECT_LT(nearest, 0.02);
  }
  EXPECT_EQ(floors, 1);
  EXPECT_EQ(walls, 5);
}

TEST(Mapper, RefinementKeepsOrBettersTheMap) {
  const Drive drive(180, 180, 3);
  const auto room = make_room();
  Sensor sensor(4);
  Mapper mapper = run(
      drive, {}, [&](std::size_t i) { return sensor.depth(drive.truth[i], at_frame(i), room); });
  const double online = ate(mapper.trajectory(), drive.truth);
  mapper.refine();
  EXPECT_LT(ate(mapper.trajectory(), drive.truth), online + 0.005);
  EXPECT_EQ(mapper.map().planes.size(), room.size());
  // It goes on afterwards.
  const AddResult result =
      mapper.add(sensor.depth(drive.truth[179], at_frame(500), room), SE3(), drive.covariance);
  EXPECT_LT((result.T_map_body.translation() - drive.truth[179].translation()).norm(), 0.03);
}

// Not what the window left them with, nor what their own evidence says with poses taken for true.
TEST(Mapper, PlanesCarryTheCovariancesOfTheRefinedGraph) {
  const Drive drive(180, 180, 3);
  const auto room = make_room();
  Sensor sensor(4);
  Mapper mapper = run(
      drive, {}, [&](std::size_t i) { return sensor.depth(drive.truth[i], at_frame(i), room); });
  mapper.refine();
  mapper.know_covariances();
  const PlanarMap map = mapper.map();
  CovarianceRequest request;
  for (const MapPlane& plane : map.planes) request.planes.push_back(PlaneId{plane.id});
  const Covariances exact = covariances(mapper.graph(), request);
  ASSERT_TRUE(exact.valid);
  ASSERT_EQ(map.planes.size(), room.size());
  mapper.set_extrinsics_covariance(1e-4 * Eigen::Matrix3d::Identity());
  const PlanarMap suspected = Mapper({}, mapper.state()).map();
  ASSERT_EQ(suspected.planes.size(), map.planes.size());
  for (std::size_t i = 0; i < map.planes.size(); ++i) {
    EXPECT_TRUE(map.planes[i].covariance_mounting.isZero(0));
    EXPECT_EQ(suspected.planes[i].covariance, map.planes[i].covariance);
    const bool upright = std::abs(map.planes[i].plane_map.normal().z()) < 0.5;
    EXPECT_EQ(suspected.planes[i].covariance_mounting.trace() > 1e-5, upright);
    const Eigen::Matrix2d observed = map.planes[i].covariance.topLeftCorner<2, 2>();
    EXPECT_TRUE(observed.isApprox(exact.planes[i].topLeftCorner<2, 2>(), 1e-6)) << i;
  }
  const auto by_noise = mapper.path_sigma();
  mapper.set_wheel_covariance(Eigen::Vector3d(1e-4, 1e-6, 1e-6).asDiagonal());
  ASSERT_TRUE(by_noise);
  EXPECT_GT(mapper.path_sigma().value_or(0), *by_noise);
  const PlanarMap unsure = Mapper({}, mapper.state()).map();
  double added = 0;
  for (std::size_t i = 0; i < map.planes.size(); ++i)
    added += (unsure.planes[i].covariance - map.planes[i].covariance).trace();
  EXPECT_GT(added, 1e-7);
}

TEST(Mapper, ScansAloneMapWallsAndSayWhatTheyDoNotSee) {
  const Drive drive(360, 180, 5);
  const auto room = make_room();
  Sensor sensor(6);
  Mapper mapper =
      run(drive, {}, [&](std::size_t i) { return sensor.scan(drive.truth[i], at_frame(i), room); });
  const PlanarMap map = mapper.map();
  EXPECT_LT(ate(map.trajectory, drive.truth), 0.02);
  EXPECT_EQ(map.planes.size(), 5u);
  for (const auto& plane : map.planes) {
    EXPECT_EQ(plane.label, PlaneLabel::kWall);
    EXPECT_GE(plane.unobserved_directions, 1);
    EXPECT_LT(std::abs(plane.plane_map.normal().z()), 0.01);
  }
}

TEST(Mapper, LapsDoNotGrowTheGraph) {
  const Drive drive(1440, 180, 7);
  const auto room = make_room();
  Sensor sensor(8);
  Mapper mapper;
  std::size_t second = 0;
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    mapper.add(sensor.scan(drive.truth[i], at_frame(i), room),
               i == 0 ? drive.truth[0] : drive.increments[i - 1], drive.covariance);
    if (i == 359) second = mapper.graph().keyframes.size() + mapper.graph().factor_count();
  }
  const std::size_t last = mapper.graph().keyframes.size() + mapper.graph().factor_count();
  EXPECT_LE(static_cast<double>(last), 1.2 * static_cast<double>(second));
  EXPECT_EQ(mapper.map().planes.size(), 5u);
  EXPECT_EQ(mapper.trajectory().size(), drive.truth.size());
  EXPECT_TRUE(mapper.graph().problems().empty());
}

// Scans that close loops with the first lap, four a lap: a hundred laps keep what six did.
TEST(Mapper, LoopsOfAHundredLapsDoNotGrowTheGraph) {
  constexpr std::size_t kLap = 60, kLaps = 100, kLoopEvery = 15;
  const Drive drive(kLap * kLaps, kLap, 7);
  const auto room = make_room();
  Sensor sensor(8);
  Mapper mapper;
  mapper.keep_frames_in(testing::TempDir());
  std::map<std::size_t, std::pair<KeyframeId, SE3>> places;  // keyframe, T_keyframe_body
  std::size_t sixth = 0;
  Matrix6d C = Matrix6d::Zero();
  C.diagonal() << Eigen::Vector3d::Constant(1e-4), Eigen::Vector3d::Constant(4e-6);
  const auto size = [&] { return mapper.graph().keyframes.size() + mapper.graph().factor_count(); };
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    const AddResult added =
        mapper.add(sensor.scan(drive.truth[i], at_frame(i), room),
                   i == 0 ? drive.truth[0] : drive.increments[i - 1], drive.covariance);
    if (i + 1 == 6 * kLap) sixth = size();
    if (i % kLoopEvery != 0) continue;
    const SE3 T_keyframe_body =
        mapper.graph().at(added.keyframe).T_map_body.inverse() * added.T_map_body;
    const auto [place, first] =
        places.try_emplace(i % kLap, std::pair(added.keyframe, T_keyframe_body));
    if (first) continue;
    const SE3 T = drive.truth[i % kLap].inverse() * drive.truth[i] *
                  SE3::planar(sensor.gauss(0.005), sensor.gauss(0.005), sensor.gauss(0.001));
    mapper.add_loop(place->second.first, added.keyframe,
                    place->second.second * T * T_keyframe_body.inverse(), C);
    if (i / kLap == 1) mapper.refine();
  }
  EXPECT_LE(static_cast<double>(size()), 1.1 * static_cast<double>(sixth));
  EXPECT_LE(mapper.graph().loops.size(), 40U);
  EXPECT_EQ(mapper.trajectory().size(), drive.truth.size());
  EXPECT_LT(ate(mapper.trajectory(), drive.truth), 0.05);
  EXPECT_TRUE(mapper.graph().problems().empty());
}

// Three laps; each frame sees floor from 1 to 3 m ahead.
TEST(Mapper, FloorOfManyLapsTakesTheRoomOfOne) {
  const Drive drive(540, 180, 21);
  const auto room = make_room();
  Sensor sensor(22);
  Mapper mapper = run(drive, {}, [&](std::size_t i) {
    Observations o = sensor.depth(drive.truth[i], at_frame(i), room);
    add_floor(o, sensor);
    return o;
  });
  mapper.refine();
  struct Floor {
    std::size_t cells = 0;
    double rms = 0;
  };
  const auto floor = [](const PlanarMap& map) {
    Floor f{map.surfels.size(), 0};
    for (const auto& s : map.surfels) f.rms += s.center.z() * s.center.z();
    f.rms = std::sqrt(f.rms / static_cast<double>(f.cells));
    return f;
  };
  const Floor before = floor(mapper.map());
  const std::size_t room_before = mapper.state().surfels.size();
  mapper.condense_floor();
  const Floor after = floor(mapper.map());
  EXPECT_LT(mapper.state().surfels.size(), 3 * room_before / 4);
  ASSERT_GT(before.cells, 500u);
  EXPECT_GT(after.cells, 0.95 * static_cast<double>(before.cells));
  EXPECT_LE(after.cells, before.cells);
  EXPECT_LT(after.rms, 1.1 * before.rms + 1e-4);
}

// Where the body is is known to 2 cm, so the gate lets a slab 4 cm before a wall pass for the wall;
// an image that shows both tells them apart.
TEST(Mapper, OneViewTellsASlabFromItsWall) {
  const std::vector<Panel> wall{{Plane({-1, 0, 0}, -5), {5, 0, 1.25}, {1.25, 3}}};
  std::vector<Panel> both = wall;
  both.push_back({Plane({-1, 0, 0}, -4.96), {4.96, 0, 0.8}, {0.7, 0.9}});
  Sensor sensor(3);
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal() << 4e-4, 4e-4, 1e-8, 1e-8, 1e-8, 4e-6;
  Mapper mapper;
  int together = 0;
  for (std::size_t i = 0; i < 20; ++i) {
    const SE3 T_map_body = SE3::planar(0.1 * static_cast<double>(i), 0, 0);
    const AddResult added = mapper.add(sensor.depth(T_map_body, at_frame(i), i < 10 ? wall : both),
                                       i == 0 ? SE3() : SE3::planar(0.1, 0, 0), covariance);
    if (i < 10) continue;
    ASSERT_EQ(added.decisions.size(), 2u);
    together += added.decisions[0].plane != PlaneId::kNone &&
                added.decisions[0].plane == added.decisions[1].plane;
  }
  EXPECT_EQ(together, 0);
  EXPECT_EQ(mapper.map().planes.size(), 2u);
}

// Odometry is off by two sigmas, as far as the slab stands before its wall: alone, the slab's view
// would fit the wall.
TEST(Mapper, ViewsOfOneMomentAreAssociatedTogether) {
  const std::vector<Panel> panels{{Plane({-1, 0, 0}, -5), {5, 0, 1.25}, {1.25, 3}},
                                  {Plane({-1, 0, 0}, -4.96), {4.96, 0, 0.8}, {0.7, 0.9}}};
  constexpr std::size_t kFrames = 20;
  constexpr double kOff = 0.04;  // m
  Sensor sensor(3);
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal() << 4e-4, 4e-4, 1e-8, 1e-8, 1e-8, 4e-6;
  MapperOptions options;
  options.association.max_distance_m = 0.03;
  Mapper mapper(options);
  std::vector<PlaneId> before;
  for (std::size_t i = 0; i < kFrames; ++i) {
    const SE3 T_map_body = SE3::planar(0.1 * static_cast<double>(i), 0, 0);
    const double off = i + 1 == kFrames ? kOff : 0;
    const AddResult added = mapper.add(sensor.depth(T_map_body, at_frame(i), panels),
                                       i == 0 ? SE3() : SE3::planar(0.1 + off, 0, 0), covariance);
    ASSERT_EQ(added.decisions.size(), 2u);
    const std::vector<PlaneId> now{added.decisions[0].plane, added.decisions[1].plane};
    if (i + 1 == kFrames) {
      EXPECT_EQ(now, before);
      EXPECT_NEAR(added.T_map_body.translation().x(), T_map_body.translation().x(), 0.01);
    }
    before = now;
  }
  EXPECT_NE(before[0], PlaneId::kNone);
  EXPECT_NE(before[0], before[1]);
}

TEST(Mapper, SameInputSameResult) {
  const Drive drive(120, 180, 9);
  const auto room = make_room();
  const auto go = [&] {
    Sensor sensor(10);
    return run(drive, {},
               [&](std::size_t i) { return sensor.depth(drive.truth[i], at_frame(i), room); })
        .trajectory();
  };
  const Trajectory a = go(), b = go();
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].pose.translation(), b[i].pose.translation());
  }
}

TEST(Mapper, NothingInTheDataMakesItThrow) {
  const double nan = std::nan("");
  Mapper mapper;
  Sensor sensor(12);
  const auto room = make_room();
  const auto abuse = [&] {
    mapper.add({}, SE3(), Matrix6d::Zero());
    mapper.add({}, SE3::planar(nan, 0, 0), Matrix6d::Constant(nan));
    for (int i = 0; i < 60; ++i) {
      Observations o = sensor.depth(SE3::planar(0.1 * i, 0, 0), at_frame(std::size_t(i)), room);
      if (i % 3 == 0) {
        PlaneObservation bad;
        bad.moments_sensor = Moments(nan, {nan, 0, 0}, Eigen::Matrix3d::Constant(nan), 9);
        bad.outline_sensor = {{nan, nan, nan}, {1, 2, 3}, {1, 2, 3}};
        o.planes.push_back(bad);
        o.planes.push_back(PlaneObservation());
        o.segments.push_back(SegmentObservation());
        o.segments.back().segment.rho = nan;
        o.floor_patches.push_back(FloorPatch());
        o.obstacle_points_body.push_back({nan, 0, 0});
      }
      mapper.add(o, SE3::planar(0.1, 0, 0),
                 i % 7 ? Matrix6d(Matrix6d::Identity() * 1e-5) : Matrix6d(-Matrix6d::Identity()));
    }
    mapper.refine();
    mapper.map();
  };
  EXPECT_NO_THROW(abuse());
  for (const auto& pose : mapper.trajectory()) EXPECT_TRUE(pose.pose.translation().allFinite());
  for (const auto& plane : mapper.map().planes) EXPECT_TRUE(plane.covariance.allFinite());
}

TEST(Mapper, AWrongMergeIsTakenBack) {
  const Drive drive(120, 180, 13);
  const auto room = make_room();
  Sensor sensor(14);
  MapperOptions options;
  options.merge_planes = true;
  Mapper mapper = run(drive, options, [&](std::size_t i) {
    return sensor.depth(drive.truth[i], at_frame(i), room);
  });
  EXPECT_FALSE(mapper.undo_merge(PlaneId(0)));
  EXPECT_FALSE(mapper.undo_merge(PlaneId(999)));
}

// The first frame sees no floor and the odometry after it errs by a degree of pitch: nothing but
// the floor that the body stands on says how the map lies.
TEST(Mapper, AMapOfABodyOnTheFloorStaysLevel) {
  Drive drive(40, 180, 15);
  constexpr double kOff = 0.0175;
  drive.increments[0] =
      drive.increments[0] * SE3::exp((Vector6d() << 0, 0, 0, 0, kOff, 0).finished());
  drive.covariance(3, 3) = drive.covariance(4, 4) = kOff * kOff;
  const auto room = make_room();
  for (const bool stands : {true, false}) {
    Sensor sensor(16);
    const Mapper mapper = run(drive, {}, [&](std::size_t i) {
      Observations o = sensor.depth(drive.truth[i], at_frame(i), room);
      if (i == 0) o.planes.clear();
      if (stands) o.first_floor_map = room[0].plane;
      return o;
    });
    double tilt = 90;
    for (const auto& plane : mapper.map().planes) {
      tilt = std::min(tilt, angle_between(plane.plane_map, room[0].plane) * 180 / M_PI);
    }
    if (stands) {
      EXPECT_LT(tilt, 0.15);
    } else {
      EXPECT_GT(tilt, 0.5);
    }
  }
}

// In another frame it is the same map: moved back, and refined there, nothing has changed.
TEST(Mapper, MovesAsOneBody) {
  const Drive drive(120, 180, 17);
  const auto room = make_room();
  Sensor sensor(18);
  Mapper mapper = run(
      drive, {}, [&](std::size_t i) { return sensor.depth(drive.truth[i], at_frame(i), room); });
  mapper.refine();
  const PlanarMap before = mapper.map();
  const SE3 T(SO3::exp({0.4, -0.3, 2}), {40, -30, 5});
  mapper.move(T);
  mapper.refine();
  const PlanarMap after = mapper.map();
  ASSERT_EQ(after.planes.size(), before.planes.size());
  for (std::size_t i = 0; i < before.trajectory.size(); i += 20) {
    const SE3 off = (T * before.trajectory[i].pose).inverse() * after.trajectory[i].pose;
    EXPECT_LT(off.log().norm(), 1e-4);
  }
  for (std::size_t i = 0; i < before.planes.size(); ++i) {
    const Plane moved = T * before.planes[i].plane_map;
    EXPECT_LT(angle_between(moved, after.planes[i].plane_map), 1e-4);
    EXPECT_NEAR(after.planes[i].covariance.trace(), before.planes[i].covariance.trace(),
                0.05 * before.planes[i].covariance.trace());
    EXPECT_NEAR(after.planes[i].area, before.planes[i].area, 0.1 * before.planes[i].area + 0.1);
  }
}

TEST(MapperOptions, SaysWhatCannotBe) {
  EXPECT_TRUE(MapperOptions().problems().empty());
  MapperOptions options;
  options.keyframe_distance_m = 0;
  options.window.keyframes = 1;
  EXPECT_EQ(options.problems().size(), 2u);
  EXPECT_THROW(Mapper{options}, Error);
}

}  // namespace
}  // namespace lamina
