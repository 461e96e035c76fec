// Scans of small exact scenes: flat floor, pits, ledges, boxes, ramps; combination and merging.
#include <gmock/gmock.h>

#include <lamina/frontend/obstacles/obstacle_scanner.hpp>
#include <lamina/models/error.hpp>

#include "frontend/obstacles/depth_scene.hpp"

namespace lamina {
namespace {

using Ray = Eigen::Vector3d;

ObstacleScan scan_of(const DepthFrame& f, const ScanOptions& options = {}) {
  FloorFrontend floor;
  ObstacleScanner scanner(options);
  return scanner.process(f, floor.process(f));
}

int count(const ObstacleScan& s, BeamCause cause) {
  return static_cast<int>(std::count(s.cause.begin(), s.cause.end(), cause));
}

TEST(ObstacleScanner, FlatFloorHasNeitherHolesNorObstacles) {
  DepthFrame f = empty_frame();
  draw(f, [](const Ray& o, const Ray& d) { return level(o, d, 0); });
  const ObstacleScan s = scan_of(f);
  ASSERT_GT(s.size(), 100u);
  EXPECT_EQ(count(s, BeamCause::kHole) + count(s, BeamCause::kLedge), 0);
  EXPECT_EQ(count(s, BeamCause::kObstacle), 0);
  EXPECT_GT(s.floor_range[s.size() / 2], 3.0F);
  // Nothing is a return, so nothing is free beyond what was seen.
  for (const float r : s.to_laser_scan().ranges) EXPECT_TRUE(std::isnan(r));
}

// The near edge, though the floor goes on behind the pit.
TEST(ObstacleScanner, PitBeginsAtItsNearEdge) {
  for (const double depth : {0.1, 0.5}) {
    DepthFrame f = empty_frame();
    draw_pit(f, 1.5, 2.5, depth);
    const ObstacleScan s = scan_of(f);
    const std::size_t middle = s.size() / 2;
    EXPECT_EQ(s.cause[middle], BeamCause::kHole) << depth;
    EXPECT_NEAR(s.range[middle], 1.5, 0.03) << depth;
    EXPECT_GT(s.sigma[middle], 0);
    EXPECT_LT(s.sigma[middle], 0.03);
  }
}

// Close to a corner a beam crosses little of the pit and sees a centimetre of its side wall; the
// rim is found by going on along it.
TEST(ObstacleScanner, RimsAreFoundUpToThePitsCorners) {
  constexpr double kNear = 1.5, kFar = 2.5, kSide = 0.4;
  DepthFrame f = empty_frame(0.35, 0.4);
  draw(f, [&](const Ray& o, const Ray& d) -> double {
    const double z = level(o, d, 0);
    const Eigen::Vector3d p = o + d * z;
    if (z <= 0 || p.x() < kNear || p.x() > kFar || std::abs(p.y()) > kSide) return z;
    const double side = d.y() != 0 ? (std::copysign(kSide, d.y()) - o.y()) / d.y() : 1e9;
    return std::min({(kFar - o.x()) / d.x(), side, level(o, d, -0.5)});
  });
  const ObstacleScan s = scan_of(f);
  int crossing = 0, reported = 0, beside = 0;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const double y = kNear * std::tan(s.angle(i)), range = std::hypot(kNear, y);
    const bool here =
        s.cause[i] == BeamCause::kHole && std::abs(static_cast<double>(s.range[i]) - range) < 0.05;
    crossing += std::abs(y) < kSide;
    reported += std::abs(y) < kSide && here;
    beside += std::abs(y) > kSide + 0.03 && s.cause[i] == BeamCause::kHole;
  }
  ASSERT_GT(crossing, 100);
  EXPECT_GE(reported, crossing - 2);
  EXPECT_EQ(beside, 0);
}

TEST(ObstacleScanner, PitWithoutAnyReturnIsALedge) {
  DepthFrame f = empty_frame();
  draw_pit(f, 1.5, 2.5, 0);
  const ObstacleScan s = scan_of(f);
  const std::size_t middle = s.size() / 2;
  EXPECT_EQ(s.cause[middle], BeamCause::kLedge);
  EXPECT_NEAR(s.range[middle], 1.5, 0.03);
}

TEST(ObstacleScanner, WrongMountingIsTakenFromTheFrame) {
  for (const double error : {-0.0175, 0.0175}) {
    DepthFrame f = empty_frame();
    draw_pit(f, 1.5, 2.5, 0.3);
    SE3& T = f.camera.camera.T_body_camera;
    T = SE3(SO3::rot_y(error) * T.so3(), T.translation());
    const ObstacleScan s = scan_of(f);
    EXPECT_EQ(s.cause[s.size() / 2], BeamCause::kHole);
    EXPECT_NEAR(s.range[s.size() / 2], 1.5, 0.03);
  }
}

TEST(ObstacleScanner, WallIsAnObstacleAtItsRange) {
  DepthFrame f = empty_frame();
  draw(f, [](const Ray& o, const Ray& d) {
    const double z = level(o, d, 0), wall = (2.0 - o.x()) / d.x();
    return z > 0 ? std::min(z, wall) : wall;
  });
  const ObstacleScan s = scan_of(f);
  const std::size_t middle = s.size() / 2;
  EXPECT_EQ(s.cause[middle], BeamCause::kObstacle);
  EXPECT_NEAR(s.range[middle], 2.0, 0.02);
  EXPECT_EQ(count(s, BeamCause::kHole) + count(s, BeamCause::kLedge), 0);
}

// Beyond x = 1.5 the ground falls (or rises) with a slope the robot can drive.
TEST(ObstacleScanner, RampsAreFloor) {
  for (const double slope : {-0.15, 0.15}) {
    DepthFrame f = empty_frame(0.45, 1.0);
    draw(f, [&](const Ray& o, const Ray& d) {
      const double z = level(o, d, 0);
      if (z > 0 && o.x() + d.x() * z < 1.5) return z;
      const double along = d.z() - slope * d.x();
      return along < 0 ? (slope * (o.x() - 1.5) - o.z()) / along : 0;
    });
    const ObstacleScan s = scan_of(f);
    EXPECT_EQ(count(s, BeamCause::kHole) + count(s, BeamCause::kLedge), 0) << slope;
    EXPECT_EQ(count(s, BeamCause::kObstacle), 0) << slope;
  }
}

// A ramp of 0.15 from x = 1.5 to 3.5; behind its end, 0.3 m up, nothing returns from the level
// ground up to the wall at x = 6, or there is none: the floor of before is seen, and a wall down to
// it.
DepthFrame crest(bool ground) {
  constexpr double kSlope = 0.15, kFoot = 1.5, kEnd = 3.5, kRise = kSlope * (kEnd - kFoot);
  DepthFrame f = empty_frame(0.3, 0.7);
  draw(f, [&](const Ray& o, const Ray& d) -> double {
    const auto x = [&](double depth) { return o.x() + d.x() * depth; };
    const double z = level(o, d, 0), wall = (6 - o.x()) / d.x();
    if (z > 0 && x(z) < kFoot) return z;
    const double along = d.z() - kSlope * d.x();
    const double ramp = along < 0 ? (kSlope * (o.x() - kFoot) - o.z()) / along : 0;
    if (ramp > 0 && x(ramp) < kEnd) return ramp;
    if (ground) return o.z() + d.z() * wall > kRise ? wall : 0;
    return z > 0 ? std::min(z, wall) : wall;
  });
  return f;
}

// A ramp of 2 m width on a level floor, its foot at x = 2: rims along its sides, none beside it or
// before its foot. Depth is rounded to disparities' eighths, as sensors do.
TEST(ObstacleScanner, TheRimsOfARampAreItsSides) {
  constexpr double kFoot = 2, kHalf = 1;
  for (const double degrees : {3.0, 5.0, 8.0, 12.0}) {
    const double slope = std::tan(degrees * M_PI / 180);
    DepthFrame f = empty_frame(0.26, 0.5);
    draw(f, [&](const Ray& o, const Ray& d) -> double {
      const double floor = level(o, d, 0), along = d.z() - slope * d.x();
      const double ramp = along < 0 ? (slope * (o.x() - kFoot) - o.z()) / along : 0;
      const Eigen::Vector3d p = o + d * ramp;
      const bool on = ramp > 0 && p.x() > kFoot && std::abs(p.y()) < kHalf;
      const double depth = on ? ramp : floor > 0 ? std::min(floor, (6 - o.x()) / d.x()) : 0;
      const double eighths = 8 * f.camera.noise.focal_baseline / depth;
      return depth > 0 ? 8 * f.camera.noise.focal_baseline / std::round(eighths) : 0;
    });
    const ObstacleScan s = scan_of(f);
    int rims = 0;
    for (std::size_t i = 0; i < s.size(); ++i) {
      if (!is_negative(s.cause[i]) || s.sigma[i] > 0.05F) continue;
      const double r = static_cast<double>(s.range[i]);
      const double x = r * std::cos(s.angle(i)), y = r * std::sin(s.angle(i));
      EXPECT_GT(x, kFoot) << degrees;
      EXPECT_LT(std::abs(y), kHalf + 0.15) << degrees << " at " << x;
      ++rims;
    }
    EXPECT_GT(rims, degrees > 3 ? 20 : 0) << degrees;
  }
}

TEST(ObstacleScanner, TheUpperEndOfARampIsNoRim) {
  const ObstacleScan s = scan_of(crest(true));
  EXPECT_EQ(count(s, BeamCause::kHole) + count(s, BeamCause::kLedge), 0);
  EXPECT_NEAR(s.floor_range[s.size() / 2], 3.5, 0.1);
}

// From a ramp, its crest half a metre ahead, little of it is left in view: the level ground beyond,
// seen as a slope that falls away, is walked on all the same.
TEST(ObstacleScanner, BeyondTheCrestOfARampFloorGoesOn) {
  FloorFrontend frontend;
  ObstacleScanner scanner;
  for (double crest = 3; crest > 0.65; crest -= 0.1) {
    DepthFrame f = empty_frame(0.26, 0.5);
    draw(f, [&](const Ray& o, const Ray& d) {
      const double z = level(o, d, 0), along = d.z() + 0.0875 * d.x();
      if (z > 0 && o.x() + d.x() * z < crest) return z;
      return along < 0 ? (0.0875 * (crest - o.x()) - o.z()) / along : 0;
    });
    const FloorResult floor = frontend.process(f);
    const ObstacleScan s = scanner.process(f, floor);
    if (crest > 1.2) continue;
    EXPECT_EQ(count(s, BeamCause::kHole) + count(s, BeamCause::kLedge), 0) << crest;
    EXPECT_GT(s.floor_range[s.size() / 2], 2) << crest << ' ' << floor.reason;
  }
}

TEST(ObstacleScanner, ARampThatEndsInTheAirIsOne) {
  const ObstacleScan s = scan_of(crest(false));
  EXPECT_EQ(s.cause[s.size() / 2], BeamCause::kHole);
  EXPECT_NEAR(s.range[s.size() / 2], 3.5, 0.1);
}

TEST(ObstacleScanner, SingleWrongPixelsChangeNothing) {
  DepthFrame f = empty_frame();
  draw(f, [](const Ray& o, const Ray& d) { return level(o, d, 0); });
  for (std::size_t i = 7; i < f.raw.size(); i += 1001) f.raw[i] = i % 2 ? 0 : 2500;
  const ObstacleScan s = scan_of(f);
  EXPECT_EQ(count(s, BeamCause::kHole) + count(s, BeamCause::kLedge), 0);
  EXPECT_EQ(count(s, BeamCause::kObstacle), 0);
}

// The document's farthest point looks past a pit that has floor behind it; its virtual floor
// method does not.
TEST(ObstacleScanner, DocumentMethodsStayAvailable) {
  ScanOptions options;
  options.method = NegativeMethod::kDocument;
  DepthFrame f = empty_frame();
  draw_pit(f, 1.5, 2.5, 0);
  ObstacleScan s = scan_of(f, options);
  EXPECT_GT(s.range[s.size() / 2], 2.5F);
  draw_pit(f, 1.5, 2.5, 0.5);
  s = scan_of(f, options);
  EXPECT_EQ(s.cause[s.size() / 2], BeamCause::kHole);
  EXPECT_NEAR(s.range[s.size() / 2], 1.5, 0.1);
}

TEST(ObstacleScanner, AnyFrameIsLegal) {
  DepthFrame f = empty_frame();
  EXPECT_EQ(count(scan_of(f), BeamCause::kHole), 0);
  f.raw.resize(10);
  EXPECT_EQ(count(scan_of(f), BeamCause::kObstacle), 0);
  EXPECT_EQ(scan_of(DepthFrame()).size(), 0u);
}

TEST(ObstacleScanner, RefusesSenselessOptions) {
  ScanOptions options;
  options.max_gap_m = -1;
  EXPECT_THROW(ObstacleScanner{options}, Error);
  EXPECT_TRUE(ScanOptions().problems().empty());
}

ObstacleScan beams(std::vector<float> range, std::vector<BeamCause> cause) {
  ObstacleScan s = ObstacleScan::empty(Timestamp(), -0.1, 0.1, range.size(), 10);
  s.range = std::move(range);
  s.cause = std::move(cause);
  return s;
}

TEST(ObstacleScan, CombinationKeepsTheNearestAndItsCause) {
  using enum BeamCause;
  const ObstacleScan a = beams({2, 3, 1}, {kObstacle, kObstacle, kEdgeOfKnowledge});
  const ObstacleScan b = beams({1, 4, 5}, {kHole, kLedge, kObstacle});
  const ObstacleScan s = combine(a, b);
  EXPECT_THAT(s.cause, testing::ElementsAre(kHole, kObstacle, kObstacle));
  EXPECT_THAT(s.range, testing::ElementsAre(1.0F, 3.0F, 5.0F));
}

TEST(ObstacleScan, LidarIsMergedInTheBodyFrame) {
  using enum BeamCause;
  const ObstacleScan depth = beams({3, 1, 3}, {kObstacle, kHole, kObstacle});
  LaserScan lidar;
  lidar.angle_min = -M_PI / 2;
  lidar.angle_increment = M_PI / 4;
  lidar.range_max = 20;
  lidar.ranges = {4, 0, 2, 0, 5};
  lidar.lidar.T_body_lidar = SE3(SO3::rot_z(0), {0.5, 0, 0.2});
  const ObstacleScan s = merge_scans(depth, lidar);
  const auto at = [&](double angle) { return static_cast<std::size_t>(s.beam_of(angle)); };
  EXPECT_EQ(s.cause[at(0)], kHole);  // 1 m; the lidar's 2.5 m is behind it
  EXPECT_EQ(s.cause[at(std::atan2(5, 0.5))], kObstacle);
  EXPECT_NEAR(s.range[at(std::atan2(5, 0.5))], std::hypot(5, 0.5), 1e-5);
  EXPECT_NEAR(s.range[at(std::atan2(-4, 0.5))], std::hypot(4, 0.5), 1e-5);
  EXPECT_NEAR(s.range[at(0.1)], 2.5, 1e-5);  // the width of a lidar beam reaches here
}

TEST(ObstacleScan, EdgePointsLieInTheMap) {
  using enum BeamCause;
  const ObstacleScan s = beams({1, 2, 3}, {kObstacle, kHole, kEdgeOfKnowledge});
  const auto edges = edge_points(s, SE3(SO3(), {10, 0, 0}));
  ASSERT_EQ(edges.size(), 2u);
  EXPECT_TRUE(edges[0].negative);
  EXPECT_NEAR(edges[0].position_map.x(), 12, 1e-6);
  EXPECT_FALSE(edges[1].negative);
}

}  // namespace
}  // namespace lamina
