// Tracks through rooms and over roofs, in any mounting.
#include <gtest/gtest.h>

#include <functional>
#include <lamina/frontend/segments/segment_frontend.hpp>
#include <map>
#include <optional>
#include <set>

#include "frontend/segments/scan_maker.hpp"

namespace lamina {
namespace {
using test::ScanMaker;

TEST(SegmentFrontend, IdsDoNotSwitchOnALoopOfARoom) {
  ScanMaker maker;
  maker.beams = 541;
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  SegmentFrontend frontend;
  std::map<int, std::set<std::int64_t>> ids_of_wall;
  SE3 last;
  const int steps = 200;
  for (int k = 0; k < steps; ++k) {
    const double a = 2 * M_PI * k / steps;
    const SE3 T_map_body = SE3::planar(4 + 1.5 * std::cos(a), 3 + std::sin(a), a + M_PI / 2);
    const auto walls = test::room(8, 6, T_map_body.translation().x(), T_map_body.translation().y(),
                                  T_map_body.so3().yaw());
    std::vector<int> hits;
    LaserScan scan = maker.scan(walls, random, &hits);
    scan.stamp = Timestamp::from_seconds(0.1 * k);
    SE3 motion = last.inverse() * T_map_body;
    motion = motion *
             SE3::planar(0.005 * normal(random), 0.005 * normal(random), 0.003 * normal(random));
    last = T_map_body;
    const Observations out =
        frontend.process(scan, k == 0 ? std::optional<SE3>() : std::optional<SE3>(motion));
    for (const SegmentObservation& s : out.segments) {
      const int wall =
          hits[static_cast<std::size_t>((s.segment.first_beam + s.segment.last_beam) / 2)];
      if (s.track >= 0) ids_of_wall[wall].insert(s.track);
    }
  }
  EXPECT_EQ(ids_of_wall.size(), 4u);
  std::set<std::int64_t> all;
  for (const auto& [wall, ids] : ids_of_wall) {
    // The field of view is 270 degrees: a wall may leave it and come back as another.
    EXPECT_LE(ids.size(), 2u) << wall;
    for (const std::int64_t id : ids) EXPECT_TRUE(all.insert(id).second) << "shared " << id;
  }
}

TEST(SegmentFrontend, OddScansAreCountedAndTheirMotionKept) {
  ScanMaker maker;
  std::mt19937 random(2);
  SegmentFrontend frontend;
  LaserScan scan = maker.scan(test::room(8, 6, 4, 3, 0), random);
  for (int k = 0; k < 4; ++k) {
    scan.stamp = Timestamp::from_seconds(0.1 * k);
    frontend.process(scan, SE3());
  }
  const std::int64_t births = frontend.tracker().counts().births;
  EXPECT_TRUE(frontend.process(scan, SE3::planar(0.5, 0, 0)).segments.empty());
  scan.stamp = Timestamp::from_seconds(0.05);
  EXPECT_TRUE(frontend.process(scan, SE3()).segments.empty());
  scan.stamp = Timestamp::from_seconds(1);
  scan.ranges.clear();
  frontend.process(scan, SE3());
  scan.ranges.assign(100, 0.0F);
  frontend.process(scan, SE3());
  EXPECT_EQ(frontend.skipped().at("scan of repeated stamp"), 1);
  EXPECT_EQ(frontend.skipped().at("scan goes back in time"), 1);
  EXPECT_EQ(frontend.skipped().at("scan without beams"), 1);
  EXPECT_EQ(frontend.skipped().at("scan without returns"), 1);
  scan = maker.scan(test::room(8, 6, 4.5, 3, 0), random);
  scan.stamp = Timestamp::from_seconds(1.1);
  const Observations out = frontend.process(scan, SE3());
  EXPECT_GE(out.segments.size(), 3u);
  for (const SegmentObservation& s : out.segments) EXPECT_GE(s.track, 0);
  EXPECT_EQ(frontend.tracker().counts().births, births);
}

// A scanner that hangs under a body and looks down, across the flight: scanner x is down.
SE3 looking_down() {
  Eigen::Matrix3d R;
  R << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  return SE3(SO3::from_matrix(R), {0.2, 0, -0.1});
}

// Flies along x over a surface that lies depth(x) below the scanner and is level across the flight;
// returns the ids seen at each step.
std::vector<std::int64_t> fly(const std::function<double(double)>& depth, double step, int steps) {
  ScanMaker maker;
  maker.beams = 481;
  maker.fov = 2 * M_PI / 3;
  std::mt19937 random(8);
  SegmentFrontend frontend;
  std::vector<std::int64_t> ids;
  for (int k = 0; k < steps; ++k) {
    const double d = depth((k - steps / 2) * step);
    LaserScan scan = maker.scan({{{d, -4}, {d, 4}}}, random);
    scan.lidar.T_body_lidar = looking_down();
    scan.stamp = Timestamp::from_seconds(0.1 * k);
    const Observations out = frontend.process(scan, SE3::planar(step, 0, 0));
    EXPECT_EQ(out.segments.size(), 1u);
    ids.push_back(out.segments.empty() ? -2 : out.segments[0].track);
  }
  return ids;
}

TEST(SegmentFrontend, ARoofFlownAlongItsRidgesNormalIsTwoTracks) {
  const auto ids = fly([](double x) { return 6 + std::abs(x) * std::tan(M_PI / 6); }, 0.1, 80);
  // After the ridge at step 40 the old id goes within five steps, and a new one comes and stays.
  EXPECT_GE(ids[38], 0);
  EXPECT_NE(ids[45], ids[38]);
  EXPECT_GE(ids[50], 0);
  EXPECT_NE(ids[50], ids[38]);
  EXPECT_EQ(ids[79], ids[50]);
  EXPECT_EQ(ids[10], ids[38]);
}

TEST(SegmentFrontend, ASlopeFlownOverIsOneTrack) {
  const auto ids = fly([](double x) { return 8 + 0.5 * x; }, 0.1, 80);
  EXPECT_EQ(std::set<std::int64_t>(ids.begin() + 3, ids.end()).size(), 1u);
}

TEST(SegmentFrontend, ATankFlownAcrossGivesNoLastingTracks) {
  const double radius = 3;
  const auto ids =
      fly([&](double x) { return 6 + radius - std::sqrt(std::max(0.0, radius * radius - x * x)); },
          0.06, 80);
  std::map<std::int64_t, int> length;
  for (const std::int64_t id : ids) length[id] += id >= 0 ? 1 : 0;
  for (const auto& [id, n] : length) EXPECT_LT(n, 30) << id;
}

// Level ground under a fan that looks down; odometry leaps by `leap` at the sixth scan.
Observations after_a_leap(const SE3& leap, SegmentFrontend& frontend,
                          std::vector<std::int64_t>& ids) {
  ScanMaker maker;
  std::mt19937 random(4);
  Observations out;
  for (int k = 0; k < 6; ++k) {
    LaserScan scan = maker.scan({{{20, -30}, {20, 30}}}, random);
    scan.lidar.T_body_lidar = looking_down();
    scan.stamp = Timestamp::from_seconds(1.0 * k);
    const SE3 motion = SE3::planar(2, 0, 0) * (k == 5 ? leap : SE3());
    out = frontend.process(scan, motion);
    ids.push_back(out.segments.empty() ? -2 : out.segments[0].track);
  }
  return out;
}

TEST(SegmentFrontend, ALeapOfOdometryIsNoticedByASingleLine) {
  const SE3 leaps[] = {SE3(SO3(), {0, 0, 50}), SE3(SO3::rot_x(22 * M_PI / 180), {0, 0, 0})};
  for (const SE3& leap : leaps) {
    SegmentFrontend frontend;
    std::vector<std::int64_t> ids;
    after_a_leap(leap, frontend, ids);
    EXPECT_GE(ids[4], 0);
    EXPECT_EQ(ids[5], ids[4]);
    EXPECT_TRUE(frontend.tracker().contradicted());
    ASSERT_TRUE(frontend.tracker().leap().has_value());
    // In the body's tangent it is what odometry did wrong.
    const Vector6d seen = looking_down().adjoint() * *frontend.tracker().leap();
    EXPECT_LT((seen - leap.log()).norm(), 0.01 * leap.log().norm());
  }
}

TEST(SegmentFrontend, OrdinaryChangesOfSpeedAreNoLeaps) {
  SegmentFrontend frontend;
  std::vector<std::int64_t> ids;
  after_a_leap(SE3::planar(1, 0.2, 0.05), frontend, ids);
  EXPECT_EQ(ids[5], ids[4]);
  EXPECT_FALSE(frontend.tracker().contradicted());
  EXPECT_FALSE(frontend.tracker().leap().has_value());
}

// Ids of the pieces of the wall x = 5, seen from the origin past the box of each scan (its front,
// empty: no box).
std::vector<std::set<std::int64_t>> ids_past_boxes(
    const std::vector<std::optional<test::Wall>>& boxes) {
  ScanMaker maker;
  std::mt19937 random(6);
  SegmentFrontend frontend;
  std::vector<std::set<std::int64_t>> out;
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    std::vector<test::Wall> walls = {{{5, -6}, {5, 6}}};
    if (boxes[k]) walls.push_back(*boxes[k]);
    LaserScan scan = maker.scan(walls, random);
    scan.stamp = Timestamp::from_seconds(0.1 * double(k));
    std::set<std::int64_t> ids;
    for (const SegmentObservation& s : frontend.process(scan, SE3()).segments) {
      if (std::abs(s.segment.rho - 5) < 0.2) ids.insert(s.track);
    }
    out.push_back(ids);
  }
  return out;
}

TEST(SegmentFrontend, AWallThatABoxDividesIsOneWall) {
  std::vector<std::optional<test::Wall>> boxes(20);
  std::fill(boxes.begin() + 5, boxes.begin() + 12, test::Wall{{3, -1}, {3, 1}});
  const auto ids = ids_past_boxes(boxes);
  for (std::size_t k = 3; k < ids.size(); ++k) {
    EXPECT_EQ(ids[k].size(), 1u) << k;
    EXPECT_EQ(ids[k], ids[3]) << k;
  }
  EXPECT_GE(*ids[3].begin(), 0);
}

TEST(SegmentFrontend, TwoPiecesThatProveToBeOneWallStayOne) {
  std::vector<std::optional<test::Wall>> boxes(24);
  std::fill(boxes.begin(), boxes.begin() + 8, test::Wall{{3, -1}, {3, 1}});
  std::fill(boxes.begin() + 14, boxes.end(), test::Wall{{3, -1}, {3, 1}});
  const auto ids = ids_past_boxes(boxes);
  EXPECT_EQ(ids[7].size(), 2u);  // 3.3 m apart
  EXPECT_EQ(ids[8].size(), 1u);
  EXPECT_EQ(ids[7].count(*ids[8].begin()), 1u);
  for (std::size_t k = 9; k < ids.size(); ++k) EXPECT_EQ(ids[k], ids[8]) << k;
}

TEST(SegmentFrontend, AWallCentimetresBehindAnotherIsNoPieceOfIt) {
  ScanMaker maker;
  std::mt19937 random(6);
  SegmentFrontend frontend;
  std::set<std::int64_t> near, far;
  for (int k = 0; k < 10; ++k) {
    LaserScan scan = maker.scan({{{5, -4}, {5, -0.5}}, {{5.08, 0.5}, {5.08, 4}}}, random);
    scan.stamp = Timestamp::from_seconds(0.1 * k);
    for (const SegmentObservation& s : frontend.process(scan, SE3()).segments) {
      if (s.track >= 0) (s.segment.start.y() < 0 ? near : far).insert(s.track);
    }
  }
  EXPECT_EQ(near.size(), 1u);
  EXPECT_EQ(far.size(), 1u);
  EXPECT_NE(near, far);
}

TEST(SegmentTracker, AGivenPlanePredictsItsTrack) {
  ScanMaker maker;
  std::mt19937 random(8);
  SegmentFrontend frontend;
  LaserScan scan = maker.scan({{{5, -4}, {5, 4}}}, random);
  scan.lidar.T_body_lidar = looking_down();
  for (int k = 0; k < 3; ++k) {
    scan.stamp = Timestamp::from_seconds(0.1 * k);
    frontend.process(scan, SE3());
  }
  // A slope z = -5.1 + 0.5 (x - 0.2) under the body: known, it is met again 4 m further on, 2 m up.
  const Plane slope(Eigen::Vector3d(-0.5, 0, 1), -5.1 - 0.1);
  const std::int64_t id = frontend.tracker().tracks().at(0).id;
  EXPECT_TRUE(frontend.set_plane(id, slope, 1e-6 * Eigen::Matrix3d::Identity()));
  EXPECT_FALSE(frontend.set_plane(id + 1, slope, 1e-6 * Eigen::Matrix3d::Identity()));
  scan = maker.scan({{{3, -4}, {3, 4}}}, random);
  scan.lidar.T_body_lidar = looking_down();
  scan.stamp = Timestamp::from_seconds(0.3);
  const Observations out = frontend.process(scan, SE3::planar(4, 0, 0));
  ASSERT_EQ(out.segments.size(), 1u);
  EXPECT_EQ(out.segments[0].track, id);
}

}  // namespace
}  // namespace lamina
