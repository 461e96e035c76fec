// The mapper in a made-up building: every wall once, poses better than odometry, nothing throws.
#include <lamina/backend/mapper.hpp>

#include <gtest/gtest.h>

#include <random>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {

// A rectangle of surface: plane, middle and half extents along the plane's tangent basis.
struct Panel {
  Plane plane;
  Eigen::Vector3d middle;
  Eigen::Vector2d half;
};

std::vector<Panel> make_room() {
  return {{Plane({0, 0, 1}, 0), {0, 0, 0}, {5, 3}},
          {Plane({-1, 0, 0}, -5), {5, 0, 1.25}, {1.25, 3}},
          {Plane({1, 0, 0}, -5), {-5, 0, 1.25}, {1.25, 3}},
          {Plane({0, -1, 0}, -3), {0, 3, 1.25}, {5, 1.25}},
          {Plane({0, 1, 0}, -3), {0, -3, 1.25}, {5, 1.25}},
          {Plane({0, -1, 0}, -1), {3.5, 1, 0.5}, {0.6, 0.5}}};
}

class Sensor {
 public:
  explicit Sensor(unsigned seed) : rng_(seed) {}
  double gauss(double sigma) { return sigma * normal_(rng_); }

  // A depth camera's view of every panel in front of the body within 6 m.
  Observations depth(const SE3& T_map_body, Timestamp stamp, const std::vector<Panel>& panels) {
    Observations o;
    o.stamp = stamp;
    o.sensor = SensorKind::kDepth;
    for (const auto& panel : panels) {
      std::vector<Eigen::Vector3d> points;
      const auto corners = visible(panel, T_map_body, points);
      if (points.size() < 30) continue;
      PlaneObservation p;
      const Plane body = T_map_body.inverse() * panel.plane;
      for (const auto& x : points) {
        p.moments_sensor.add(T_map_body.inverse() * x + gauss(0.005) * body.normal(), 1 / 2.5e-5);
      }
      const auto fit = p.moments_sensor.fit_plane(Eigen::Vector3d(0, 0, 0.5), 1.0);
      if (!fit) continue;
      p.plane_sensor = fit->plane;
      p.floor = {0.001, 0.0005};
      for (const auto& c : corners) p.outline_sensor.push_back(T_map_body.inverse() * c);
      if (panel.plane.normal().z() > 0.9) p.kind = PlaneKind::kDominantFloor;
      o.planes.push_back(p);
    }
    return o;
  }

  // A scanner half a metre up: segments of the walls.
  Observations scan(const SE3& T_map_body, Timestamp stamp, const std::vector<Panel>& panels) {
    Observations o;
    o.stamp = stamp;
    o.T_body_sensor = SE3::from_translation({0, 0, 0.5});
    const SE3 T_map_sensor = T_map_body * o.T_body_sensor;
    for (const auto& panel : panels) {
      if (std::abs(panel.plane.normal().z()) > 0.5) continue;
      const Eigen::Vector3d along = panel.plane.normal().cross(Eigen::Vector3d::UnitZ());
      const double half = std::abs(along.x()) > 0.5 ? std::max(panel.half.x(), panel.half.y()) : 3;
      if (panel.middle.z() + 0.5 < 0.5 ||
          panel.plane.signed_distance(T_map_sensor.translation()) < 0.2) {
        continue;
      }
      SegmentObservation s;
      const Eigen::Vector3d n_sensor = T_map_sensor.so3().inverse() * panel.plane.normal();
      for (double u = -half; u <= half; u += 0.05) {
        Eigen::Vector3d x = panel.middle + u * along;
        x.z() = T_map_sensor.translation().z();
        const Eigen::Vector3d seen = T_map_sensor.inverse() * x + gauss(0.01) * n_sensor;
        s.segment.moments.add({seen.x(), seen.y(), 0}, 1e4);
        if (u == -half) s.segment.start = seen.head<2>();
        s.segment.end = seen.head<2>();
      }
      const auto line = s.segment.moments.fit_line();
      if (!line) continue;
      Eigen::Vector3d n(-line->direction.y(), line->direction.x(), 0);
      if (n.dot(s.segment.moments.mean()) < 0) n = -n;  // away from the scanner
      s.segment.theta = std::atan2(n.y(), n.x());
      s.segment.rho = n.dot(s.segment.moments.mean());
      s.segment.count = static_cast<int>(s.segment.moments.count());
      s.floor = {0.002, 0.0005};
      o.segments.push_back(s);
    }
    return o;
  }

 private:
  static std::vector<Eigen::Vector3d> visible(const Panel& panel, const SE3& T_map_body,
                                              std::vector<Eigen::Vector3d>& points) {
    const Matrix32d B = panel.plane.tangent_basis();
    std::vector<Eigen::Vector2d> flat;
    if (panel.plane.signed_distance(T_map_body * Eigen::Vector3d(0, 0, 0.5)) < 0.1) return {};
    for (double u = -panel.half.x(); u <= panel.half.x(); u += 0.1) {
      for (double v = -panel.half.y(); v <= panel.half.y(); v += 0.1) {
        const Eigen::Vector3d x = panel.middle + B * Eigen::Vector2d(u, v);
        const Eigen::Vector3d body = T_map_body.inverse() * x;
        if (body.x() < 0.5 || body.x() > 6 || std::abs(body.y()) > 0.7 * body.x()) continue;
        points.push_back(x);
        flat.emplace_back(u, v);
      }
    }
    std::vector<Eigen::Vector3d> corners;
    if (const auto hull = Polygon::convex_hull(flat)) {
      for (const auto& v : hull->vertices()) corners.push_back(panel.middle + B * v);
    }
    return corners;
  }

  std::mt19937 rng_;
  std::normal_distribution<double> normal_;
};

// Laps of an ellipse, four frames a keyframe, odometry that drifts.
struct Drive {
  std::vector<SE3> truth;
  std::vector<SE3> increments;  // as odometry tells them
  Matrix6d covariance = Matrix6d::Zero();

  Drive(int frames, int frames_a_lap, unsigned seed, double bias_yaw = 0) {
    Sensor noise(seed);
    const double st = 0.003, sr = 0.002;
    covariance.diagonal() << st * st, st * st, 1e-8, 1e-8, 1e-8, sr * sr;
    for (int i = 0; i < frames; ++i) {
      const double a = 2 * M_PI * i / frames_a_lap;
      truth.push_back(
          SE3::planar(2 * std::sin(a), 1 - std::cos(a), std::atan2(std::sin(a), 2 * std::cos(a))));
    }
    for (int i = 1; i < frames; ++i) {
      Vector6d e = Vector6d::Zero();
      e << noise.gauss(st), noise.gauss(st), 0, 0, 0, noise.gauss(sr) + bias_yaw;
      increments.push_back(truth[i - 1].inverse() * truth[i] * SE3::exp(e));
    }
  }
};

double ate(const Trajectory& path, const std::vector<SE3>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    sum += (path[i].pose.translation() - truth[i].translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(path.size()));
}

Timestamp at_frame(std::size_t i) {
  return Timestamp::from_nanoseconds(100000000LL * std::int64_t(i));
}

template <class See>
Mapper run(const Drive& drive, const MapperOptions& options, See see) {
  Mapper mapper(options);
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    mapper.add(see(i), i == 0 ? drive.truth[0] : drive.increments[i - 1], drive.covariance);
  }
  return mapper;
}

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
