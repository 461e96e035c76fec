// Input that leaves directions open: the result is defined, says how many, and holds no NaN.
#include <gtest/gtest.h>

#include <lamina/backend/refine/refiner.hpp>

#include "backend/mapper/mapper_room.hpp"

namespace lamina {
namespace {

using namespace made_up;  // NOLINT

// Views of walls (a point of each and its normal) from three poses that nothing else connects.
Graph sightings(const std::vector<Plane>& walls) {
  Graph graph;
  for (int i = 0; i < 3; ++i) graph.add_keyframe(Timestamp::from_seconds(i), SE3());
  for (const Plane& wall : walls) {
    const Eigen::Vector3d middle = wall.rho() * wall.normal();
    const PlaneId id = graph.add_plane(PlaneLandmark::at(wall, middle));
    const Matrix32d B = wall.tangent_basis();
    Moments seen;
    for (double u = -1; u <= 1; u += 0.5) {
      for (double v = -1; v <= 1; v += 0.5) seen.add(middle + B * Eigen::Vector2d(u, v), 1e4);
    }
    for (const Keyframe& keyframe : graph.keyframes) {
      graph.plane_moments.push_back({keyframe.id, id, seen.discounted(wall.normal(), {})});
    }
  }
  return graph;
}

void expect_finite(const Graph& graph) {
  for (const auto& k : graph.keyframes) {
    EXPECT_TRUE(k.T_map_body.translation().allFinite());
    EXPECT_TRUE(k.T_map_body.so3().quaternion().coeffs().allFinite());
  }
  for (const auto& p : graph.planes) {
    EXPECT_TRUE(p.plane_anchor.normal().allFinite());
    EXPECT_TRUE(std::isfinite(p.plane_anchor.rho()));
  }
}

struct Case {
  const char* name;
  std::vector<Plane> walls;
  int open;  // directions, of the two poses that are not held
};

TEST(Degenerate, GraphsWithoutOdometryStateTheirRankDeficiency) {
  const Eigen::Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  const std::vector<Case> cases = {
      {"one plane", {Plane(-x, -3)}, 6},  // along it twice and about its normal, for each pose
      {"parallel planes", {Plane(-x, -3), Plane(x, -3)}, 6},
      {"two families of planes", {Plane(-x, -3), Plane(y, -2)}, 2},  // along their common line
      {"all directions", {Plane(-x, -3), Plane(y, -2), Plane(z, 0)}, 0},
      {"a plane through the sensor", {Plane(z, 0)}, 6},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    Graph graph = sightings(c.walls);
    const RefineResult result = refine(graph);
    EXPECT_EQ(result.status, SolveStatus::kConverged);
    EXPECT_EQ(result.held, std::vector<KeyframeId>{KeyframeId(0)});
    EXPECT_EQ(result.rank_deficiency, c.open);
    expect_finite(graph);
  }
}

TEST(Degenerate, UnconnectedPartsAreHeldOneByOneAndStateWhatIsOpen) {
  Graph graph = sightings({Plane({-1, 0, 0}, -3)});
  for (int i = 0; i < 2; ++i) graph.add_keyframe(Timestamp::from_seconds(10 + i), SE3());
  graph.odometry.push_back({KeyframeId(3), KeyframeId(4), SE3::planar(1, 0, 0)});
  const RefineResult result = refine(graph);
  EXPECT_EQ(result.status, SolveStatus::kConverged);
  EXPECT_EQ(result.held, (std::vector<KeyframeId>{KeyframeId(0), KeyframeId(3)}));
  EXPECT_EQ(result.rank_deficiency, 6);
  expect_finite(graph);
}

// The same through the mapper: what is seen decides, odometry says nothing.
TEST(Degenerate, TheMapperSaysHowUnsureItIs) {
  const auto room = make_room();
  const std::vector<std::vector<Panel>> worlds = {{}, {room[3]}, {room[3], room[4]}, room};
  for (const auto& world : worlds) {
    SCOPED_TRACE(world.size());
    Drive drive(60, 180, 3);
    drive.covariance = 0.25 * Matrix6d::Identity();
    Sensor sensor(4);
    Mapper mapper = run(
        drive, {}, [&](std::size_t i) { return sensor.scan(drive.truth[i], at_frame(i), world); });
    const Eigen::Vector3d variances = mapper.current_covariance().diagonal().head<3>();
    EXPECT_TRUE(variances.allFinite());
    // Two walls along x leave x open, four tell it.
    const double along = mapper.current_pose().so3().matrix().row(0).cwiseAbs2().dot(variances);
    if (world.size() < 3) {
      EXPECT_GT(along, 1);
    }
    if (world.size() > 3) {
      EXPECT_LT(along, 0.2 * 0.2);  // pitch is open, the scanner half a metre up
    }
    EXPECT_EQ(mapper.map().planes.size(),
              world.empty() ? 0 : std::min<std::size_t>(5, world.size()));
    const RefineResult result = mapper.refine();
    EXPECT_NE(result.status, SolveStatus::kInvalidInput);
    expect_finite(mapper.graph());
    for (const auto& plane : mapper.map().planes) EXPECT_TRUE(plane.covariance.allFinite());
  }
}

// A plane that goes through the scanner itself is seen edge on: it is no plane of the map, and what
// is not through the sensor is mapped as ever.
TEST(Degenerate, APlaneThroughTheSensorHarmsNothing) {
  const auto room = make_room();
  const Drive drive(60, 180, 5);
  Sensor sensor(6);
  Mapper mapper = run(drive, {}, [&](std::size_t i) {
    Observations o = sensor.depth(drive.truth[i], at_frame(i), room);
    PlaneObservation through;
    for (double u = -1; u <= 1; u += 0.2) {
      for (double v = -1; v <= 1; v += 0.2) through.moments_sensor.add({u, 0, v}, 1e4);
    }
    through.plane_sensor = Plane({0, 1, 0}, 0);
    through.outline_sensor = {{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}};
    o.planes.push_back(through);
    return o;
  });
  mapper.refine();
  expect_finite(mapper.graph());
  EXPECT_LT(ate(mapper.trajectory(), drive.truth), 0.15);
}

// ------------------------------------------------------------- segments of a leaning scanner

// What a scanner that leans sees of panels: one segment for each that it hits ten times.
Observations leaning_scan(const SE3& T_map_body, const SE3& T_body_sensor, Timestamp stamp,
                          const std::vector<Panel>& panels, Sensor& noise) {
  Observations o;
  o.stamp = stamp;
  o.T_body_sensor = T_body_sensor;
  const SE3 T = T_map_body * T_body_sensor;
  std::vector<std::vector<Eigen::Vector2d>> hits(panels.size());
  for (double a = -M_PI / 2; a <= M_PI / 2; a += M_PI / 360) {
    const Eigen::Vector3d beam = T.so3() * Eigen::Vector3d(std::cos(a), std::sin(a), 0);
    double nearest = 20;
    std::size_t hit = panels.size();
    for (std::size_t k = 0; k < panels.size(); ++k) {
      const double towards = panels[k].plane.normal().dot(beam);
      if (towards > -0.05) continue;
      const double range = -panels[k].plane.signed_distance(T.translation()) / towards;
      const Eigen::Vector2d on = panels[k].plane.tangent_basis().transpose() *
                                 (T.translation() + range * beam - panels[k].middle);
      const bool inside = (on.cwiseAbs() - panels[k].half).maxCoeff() <= 0;
      if (!inside || range < 0.2 || range > nearest) continue;
      nearest = range;
      hit = k;
    }
    if (hit == panels.size()) continue;
    const double range = nearest + noise.gauss(0.01);
    hits[hit].emplace_back(range * std::cos(a), range * std::sin(a));
  }
  for (std::size_t k = 0; k < panels.size(); ++k) {
    if (hits[k].size() < 10) continue;
    SegmentObservation s;
    for (const auto& p : hits[k]) s.segment.moments.add({p.x(), p.y(), 0}, 1e4);
    const auto line = s.segment.moments.fit_line();
    if (!line) continue;
    Eigen::Vector3d n(-line->direction.y(), line->direction.x(), 0);
    if (n.dot(s.segment.moments.mean()) < 0) n = -n;  // away from the scanner
    s.segment.start = hits[k].front();
    s.segment.end = hits[k].back();
    s.segment.theta = std::atan2(n.y(), n.x());
    s.segment.rho = n.dot(s.segment.moments.mean());
    s.segment.count = static_cast<int>(hits[k].size());
    s.floor = {0.002, 0.0005};
    s.track = static_cast<std::int64_t>(k);
    o.segments.push_back(s);
  }
  return o;
}

// `moving`: along a bent way; otherwise the scanner stands still.
Mapper lean_through(const std::vector<Panel>& room, int frames, bool moving) {
  const SE3 T_body_sensor(SO3::exp(Eigen::Vector3d(0, 0.5, 0)), {0, 0, 1});  // 29 degrees down
  Sensor noise(21);
  Mapper mapper;
  SE3 before;
  for (int i = 0; i < frames; ++i) {
    const double way = moving ? 0.05 * i : 0;
    const SE3 truth = SE3::planar(way - 3, 0.3 * way - 1, 0.3 * std::sin(way));
    Vector6d e;
    for (int k = 0; k < 6; ++k) e(k) = noise.gauss(1e-3);  // m and rad a step
    const SE3 moved = i == 0 ? truth : before.inverse() * truth * SE3::exp(e);
    mapper.add(leaning_scan(truth, T_body_sensor, at_frame(std::size_t(i)), room, noise), moved,
               1e-6 * Matrix6d::Identity());
    before = truth;
  }
  return mapper;
}

TEST(Segments2d, ALeaningScannerThatMovesTellsPlanesFromTwentySegments) {
  const auto room = make_room();
  const Mapper mapper = lean_through(room, 80, true);
  int observed = 0;
  for (const auto& plane : mapper.map().planes) {
    if (plane.observations < 20) continue;
    double angle = M_PI, distance = 1;
    for (const auto& panel : room) {
      const double apart = std::abs(panel.plane.signed_distance(plane.centroid_map));
      const double off = angle_between(panel.plane, plane.plane_map);
      if (off > 0.3 || apart > distance) continue;
      angle = off;
      distance = apart;
    }
    EXPECT_EQ(plane.unobserved_directions, 0);
    EXPECT_LT(angle, M_PI / 180);
    EXPECT_LT(distance, 0.02);
    ++observed;
  }
  EXPECT_GE(observed, 3);
}

TEST(Segments2d, WhatAStandingScannerDoesNotSeeIsSaid) {
  const Mapper mapper = lean_through(make_room(), 8, false);
  const auto planes = mapper.map().planes;
  EXPECT_GE(planes.size(), 3u);
  // Its segments all but coincide: the tilt about them is open.
  for (const auto& plane : planes) EXPECT_EQ(plane.unobserved_directions, 1);
}

}  // namespace
}  // namespace lamina
