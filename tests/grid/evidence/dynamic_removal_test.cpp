// What moved on leaves the map; what stands, hangs, is thin or was put down stays.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include <lamina/grid/evidence/dynamic_removal.hpp>
#include <lamina/grid/evidence/scan_visibility.hpp>

#include "pipeline/box_hall.hpp"

namespace lamina {
namespace {

const Box kPerson{{1.8, -0.2, 0}, {2.0, 0.2, 1.7}};
const Box kTop{{1.8, -0.5, 0.68}, {2.6, 0.5, 0.72}};  // of a table

// A hall with a wall at x = 5, a camera at 0.6 m that looks along x, down by `pitch`.
struct Drive {
  SightVotes votes;
  PlanarMap map;
  double pitch = 0.2;
  int k = 0;

  // Four images a second from `x`; the path says that it was `off` m further on.
  void see(int images, const std::vector<Box>& boxes, double x = 0, double off = 0) {
    const DepthFrame frame = BoxHall{boxes}.image(x, pitch);
    const DepthLook look = depth_look(frame);
    for (int i = 0; i < images; ++i) {
      const auto stamp = Timestamp::from_nanoseconds(std::int64_t{k++} * 250'000'000);
      votes.add(stamp, look, frame.camera.camera.T_body_camera);
      map.trajectory.add(stamp, SE3::from_translation({x + off, 0, 0}));
    }
  }
  void stands(const Eigen::Vector3d& p) { map.loose_points.push_back(p); }
  // Upright, facing the camera, 0.4 m wide.
  void wall_of_person() {
    MapPlane plane;
    plane.label = PlaneLabel::kWall;
    plane.plane_map = Plane({-1, 0, 0}, -1.8);
    plane.centroid_map = {1.8, 0, 0.4};
    plane.outlines_map = {{{1.8, -0.2, 0.1}, {1.8, 0.2, 0.1}, {1.8, 0.2, 0.7}, {1.8, -0.2, 0.7}}};
    map.planes.push_back(plane);
  }
  PlanarMap result(const SightVotes::ForEachScan& scans = {}) const {
    PlanarMap found = map;
    votes.withdraw(found, map.trajectory, 0.05, scans);
    PlanarMap by_three = map;
    votes.withdraw(by_three, map.trajectory, 0.05, scans, 3);
    EXPECT_EQ(by_three.loose_points, found.loose_points);
    EXPECT_EQ(by_three.planes.size(), found.planes.size());
    for (std::size_t i = 0; i < found.planes.size(); ++i)
      EXPECT_EQ(by_three.planes[i].outlines_map, found.planes[i].outlines_map);
    EXPECT_EQ(by_three.edges.size(), found.edges.size());
    for (std::size_t i = 0; i < found.edges.size(); ++i)
      EXPECT_EQ(by_three.edges[i].position_map, found.edges[i].position_map);
    return found;
  }
};

TEST(SightVotes, APersonWhoWalkedOnLeavesTheMap) {
  Drive drive;
  drive.stands({1.82, 0.02, 0.55});
  drive.stands({5.02, 0.02, 0.55});  // the wall
  drive.wall_of_person();
  drive.see(6, {kPerson});
  EXPECT_EQ(drive.result().loose_points.size(), 2u);
  EXPECT_EQ(drive.result().planes.size(), 1u);
  drive.see(2, {});  // may be noise
  EXPECT_EQ(drive.result().loose_points.size(), 2u);
  drive.see(1, {});
  const PlanarMap map = drive.result();
  ASSERT_EQ(map.loose_points.size(), 1u);
  EXPECT_EQ(map.loose_points[0].x(), 5.02);
  EXPECT_TRUE(map.planes.empty());
}

// From near, the camera sees what is lower than 0.45 m alone: the rest has gone with that.
TEST(SightVotes, WhatStoodOnItHasGoneWithIt) {
  Drive drive;
  drive.stands({1.82, 0.02, 0.73});
  drive.see(4, {kPerson}, -1);
  drive.pitch = 0.5;
  drive.see(4, {});
  EXPECT_TRUE(drive.result().loose_points.empty());
}

TEST(SightVotes, ATableStaysWhoeverStoodBeforeIt) {
  Drive drive;
  drive.stands({1.82, 0.02, 0.7});
  drive.see(4, {kTop}, -1);  // legs are out of view: it hangs over seen ground
  drive.see(4, {kTop, kPerson}, -1);
  drive.pitch = 0.5;
  drive.see(9, {});  // what is under it alone
  EXPECT_EQ(drive.result().loose_points.size(), 1u);
}

TEST(SightVotes, WhatWasPutDownStays) {
  const Box box{{1.8, -0.2, 0}, {2.2, 0.2, 0.5}};
  Drive drive;
  drive.stands({1.82, 0.02, 0.45});
  drive.see(30, {});
  drive.see(6, {box});
  EXPECT_EQ(drive.result().loose_points.size(), 1u);
  EXPECT_TRUE(drive.result().edges.empty());
}

// Met in two looks, where many had gone past before, and never looked at again: nobody knows.
TEST(SightVotes, WhereSomebodyWasMetInPassingKnowledgeEnds) {
  Drive drive;
  drive.stands({1.82, 0.02, 0.45});
  drive.see(8, {});
  drive.see(2, {kPerson});
  const PlanarMap map = drive.result();
  EXPECT_TRUE(map.loose_points.empty());
  ASSERT_EQ(map.edges.size(), 1u);
  EXPECT_FALSE(map.edges[0].negative);
}

// Later looks see where one half of a person stood, a screen bars them from the other half.
const Box kScreen{{0.5, 0.01, 0}, {0.6, 3, 1.5}};

void stands_half_behind_the_screen(Drive& drive) {
  for (const double y : {-0.17, -0.12, 0.12, 0.17}) drive.stands({1.82, y, 0.55});
}

TEST(SightVotes, OfAPersonHalfGoneNobodyKnowsTheOtherHalf) {
  Drive drive;
  stands_half_behind_the_screen(drive);
  drive.see(4, {kPerson});
  EXPECT_EQ(drive.result().loose_points.size(), 4u);
  drive.see(4, {kScreen});
  const PlanarMap map = drive.result();
  EXPECT_TRUE(map.loose_points.empty());
  ASSERT_EQ(map.edges.size(), 2u);
  EXPECT_GT(map.edges[0].position_map.y(), 0);
  EXPECT_FALSE(map.edges[0].negative);
}

TEST(SightVotes, WhatWasMetWithoutThePersonBesideItStays) {
  const Box box{{1.8, 0.05, 0}, {2.0, 0.2, 0.6}};
  Drive drive;
  stands_half_behind_the_screen(drive);
  drive.see(2, {box});
  drive.see(4, {kPerson});
  drive.see(4, {kScreen});
  const PlanarMap map = drive.result();
  ASSERT_EQ(map.loose_points.size(), 2u);
  EXPECT_GT(map.loose_points[0].y(), 0);
  EXPECT_TRUE(map.edges.empty());
}

// A person stood in line with the face of a box: one plane, which ends with the box again.
TEST(SightVotes, WhatAPersonAddedToAPlaneIsCutOff) {
  const Box box{{1.8, 0.2, 0}, {2.2, 0.6, 0.8}};
  Drive drive;
  drive.wall_of_person();
  for (auto& p : drive.map.planes[0].outlines_map[0]) p.y() = p.y() > 0 ? 0.6 : -0.2;
  drive.see(6, {kPerson, box});
  drive.see(4, {box});
  const PlanarMap map = drive.result();
  ASSERT_EQ(map.planes.size(), 1u);
  ASSERT_EQ(map.planes[0].outlines_map.size(), 1u);
  double low = 9, high = -9;
  for (const auto& p : map.planes[0].outlines_map[0]) {
    low = std::min(low, p.y());
    high = std::max(high, p.y());
  }
  EXPECT_NEAR(low, 0.2, 0.11);
  EXPECT_NEAR(high, 0.6, 0.06);
  EXPECT_NEAR(map.planes[0].area, 0.6 * (high - low), 0.05);
}

// A metre and a half off, they go past the wall as well: their path is wrong.
TEST(SightVotes, LooksThatGoPastALargeWallTakeNothingAway) {
  const Box post{{1.8, -0.2, 0}, {2.0, 0.2, 0.5}}, bar{{1.6, -0.12, 0}, {1.61, 0.12, 0.6}};
  Drive drive;
  drive.stands({1.82, 0, 0.4});
  MapPlane wall;
  wall.plane_map = Plane({-1, 0, 0}, -5);
  wall.centroid_map = {5, 0, 0.8};
  wall.outlines_map = {{{5, -2.5, 0}, {5, 2.5, 0}, {5, 2.5, 1.6}, {5, -2.5, 1.6}}};
  wall.area = 8;
  drive.map.planes.push_back(wall);
  drive.see(6, {post});
  drive.see(3, {}, -1.5, 1.5);
  drive.see(3, {bar});
  EXPECT_EQ(drive.result().loose_points.size(), 1u);
  drive.see(3, {});
  EXPECT_TRUE(drive.result().loose_points.empty());
}

// From afar a square of the image takes in a place beside the post, too; from near it does not.
TEST(SightVotes, LooksFromNearOutvoteThoseFromAfar) {
  const Box post{{1.8, 0.13, 0}, {2.0, 0.5, 1}};
  Drive drive;
  drive.stands({1.82, 0.03, 0.45});
  drive.stands({1.82, 0.18, 0.45});  // the post
  drive.see(6, {post}, -3);
  ASSERT_EQ(drive.result().loose_points.size(), 2u);
  drive.see(4, {post}, 0.5);
  drive.see(6, {post}, -3);
  const PlanarMap map = drive.result();
  ASSERT_EQ(map.loose_points.size(), 1u);
  EXPECT_EQ(map.loose_points[0].y(), 0.18);
}

// Views from afar closed it; the robot drove through.
TEST(SightVotes, ADoorThatWasDrivenThroughIsOpen) {
  const std::vector<Box> jambs{{{1.8, -2.5, 0}, {1.9, -0.45, 1.6}},
                               {{1.8, 0.45, 0}, {1.9, 2.5, 1.6}}};
  Drive drive;
  MapPlane wall;
  wall.plane_map = Plane({-1, 0, 0}, -1.8);
  wall.centroid_map = {1.8, 0, 0.8};
  wall.outlines_map = {{{1.8, -2.5, 0}, {1.8, 2.5, 0}, {1.8, 2.5, 1.6}, {1.8, -2.5, 1.6}}};
  wall.area = 8;
  drive.map.planes.push_back(wall);
  wall.id = 1;  // the far end: what is no wall is a small part of all
  wall.plane_map = Plane({-1, 0, 0}, -5);
  wall.centroid_map.x() = 5;
  for (Eigen::Vector3d& p : wall.outlines_map[0]) p.x() = 5;
  drive.map.planes.push_back(wall);
  for (const double x : {-1.0, 0.0, 0.8}) drive.see(4, jambs, x);
  ASSERT_EQ(drive.result().planes.size(), 2u);
  EXPECT_EQ(drive.result().planes[0].outlines_map.size(), 1u);  // not driven through yet
  drive.see(1, jambs, 1.5);
  drive.see(1, jambs, 2.2);
  const PlanarMap map = drive.result();
  ASSERT_EQ(map.planes.size(), 2u);
  ASSERT_EQ(map.planes[0].outlines_map.size(), 2u);
  EXPECT_EQ(map.planes[1].outlines_map.size(), 1u);
  EXPECT_LT(map.planes[0].area, 8 - 0.55 * 1.6);
  for (const auto& outline : map.planes[0].outlines_map) {
    for (const Eigen::Vector3d& p : outline) EXPECT_GT(std::abs(p.y()), 0.29);
  }
}

// A rod of 4 mm, met from near; the image from afar has no pixel on it.
TEST(SightVotes, LooksFromAfarTakeNoThinThingsAway) {
  const Box rod{{1.02, 0.018, 0}, {1.024, 0.022, 1}};
  Drive drive;
  drive.stands({1.022, 0.02, 0.5});
  drive.see(4, {rod}, 0.3);
  drive.see(9, {}, -1.5);
  EXPECT_EQ(drive.result().loose_points.size(), 1u);
}

TEST(SightVotes, ALowPlateStays) {
  Drive drive;
  drive.stands({1.82, 0.02, 0.01});
  drive.see(9, {});
  EXPECT_EQ(drive.result().loose_points.size(), 1u);
}

LaserScan scan_of(int k, double range) {
  LaserScan scan;
  scan.stamp = Timestamp::from_nanoseconds(std::int64_t{k} * 250'000'000);
  scan.angle_min = -1;
  scan.angle_increment = 0.01;
  scan.range_max = 20;
  scan.ranges.assign(200, static_cast<float>(range));
  scan.lidar.T_body_lidar = SE3::from_translation({0, 0, 0.5});
  return scan;
}

TEST(SightVotes, AScannerSeesThemGoBesideTheCamera) {
  Drive drive;
  drive.stands({1.82, 0.02, 0.5});
  drive.see(4, {kPerson});
  drive.see(6, {{{0.5, -3, 0}, {0.6, 3, 1}}});  // the camera's view is barred
  EXPECT_EQ(drive.result().loose_points.size(), 1u);
  const auto scans = [](const std::function<void(const KeptScan&)>& take) {
    for (int k = 4; k < 8; ++k) take({scan_of(k, 4), false});
  };
  EXPECT_TRUE(drive.result(scans).loose_points.empty());
}

TEST(ScanSight, BeamsAboutAPlaceMeetItOrGoPast) {
  LaserScan scan = scan_of(0, 3);
  EXPECT_EQ(sight_of(scan, {3, 0, 0}, 0.06), Sight::kMet);
  EXPECT_EQ(sight_of(scan, {2, 0, 0}, 0.06), Sight::kPast);
  EXPECT_EQ(sight_of(scan, {4, 0, 0}, 0.06), Sight::kUnknown);
  EXPECT_EQ(sight_of(scan, {2, 0, 0.2}, 0.06), Sight::kUnknown);
  EXPECT_EQ(sight_of(scan, {-2, 0, 0}, 0.06), Sight::kUnknown);
  scan.ranges[101] = 0;  // no return
  EXPECT_EQ(sight_of(scan, {2, 0, 0}, 0.06), Sight::kUnknown);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    scan.angles.push_back(static_cast<float>(-0.5 + 0.01 * static_cast<double>(i)));
  }
  EXPECT_EQ(sight_of(scan, {2, 0, 0}, 0.06), Sight::kPast);
}

TEST(SightVotes, ComesBackFromASession) {
  Drive drive;
  drive.stands({1.82, 0.02, 0.55});
  std::vector<SeenDepth> none;
  drive.see(4, {kPerson});
  drive.see(4, {});
  drive.votes.take(none);
  EXPECT_EQ(drive.votes.seen().size(), 0u);
  EXPECT_EQ(drive.result().loose_points.size(), 1u);
}

}  // namespace
}  // namespace lamina
