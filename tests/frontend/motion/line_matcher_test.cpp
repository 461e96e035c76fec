// Nearest oriented points, and point-to-line matching.
#include <gmock/gmock.h>

#include <lamina/frontend/motion/line_matcher.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

TEST(PointMap, NearestIsTheNearestByBruteForce) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> u(-3, 3);
  std::vector<OrientedPoint> points(400);
  for (OrientedPoint& p : points) {
    p.point = {u(rng), u(rng)};
    p.normal = Eigen::Vector2d(u(rng), u(rng)).normalized();
  }
  const PointMap map(points);
  for (int k = 0; k < 300; ++k) {
    const Eigen::Vector2d q(1.3 * u(rng), 1.3 * u(rng));
    const Eigen::Vector2d n = Eigen::Vector2d(u(rng), u(rng)).normalized();
    const double radius = 0.1 + 0.3 * std::abs(u(rng));
    double best = radius;
    bool any = false;
    for (const OrientedPoint& p : points) {
      if (p.normal.dot(n) <= 0.7 || (p.point - q).norm() >= best) continue;
      best = (p.point - q).norm();
      any = true;
    }
    const OrientedPoint* found = map.nearest(q, n, radius);
    ASSERT_EQ(found != nullptr, any);
    // Whatever is guessed.
    EXPECT_EQ(map.nearest(q, n, radius, &map.points()[static_cast<std::size_t>(k)]), found);
    EXPECT_EQ(map.nearest(q, n, radius, found), found);
    if (found) {
      EXPECT_DOUBLE_EQ((found->point - q).norm(), best);
    }
  }
}

TEST(PointMap, OfPointsAtOnePlaceTheFirstIsNearest) {
  std::vector<OrientedPoint> points(50, {{0.2, 0.1}, {1, 0}, 0.01});
  points.push_back({{3, 4}, {1, 0}, 0.01});
  const PointMap map(points);
  EXPECT_EQ(map.nearest({0.3, 0.1}, {1, 0}, 1), map.points().data());
  EXPECT_EQ(map.nearest({0.3, 0.1}, {1, 0}, 1, &map.points()[20]), map.points().data());
}

TEST(PointMap, EmptyAndFarAwayFindNothing) {
  EXPECT_EQ(PointMap().nearest({0, 0}, {1, 0}, 5), nullptr);
  const PointMap map(std::vector<OrientedPoint>(1, {{0, 0}, {1, 0}, 0.01}));
  EXPECT_EQ(map.nearest({1e9, -1e9}, {1, 0}, 5), nullptr);
  EXPECT_NE(map.nearest({0.1, 0}, {1, 0}, 5), nullptr);
}

TEST(OrientedPoints, NormalsOfARoomPointInwards) {
  testing::Scanner scanner;
  scanner.sigma = 0.005;
  const auto points = oriented_points(scanner.scan(testing::room(), SE3(), 0));
  int oriented = 0;
  for (const OrientedPoint& p : points) {
    if (!p.oriented()) continue;
    ++oriented;
    EXPECT_NEAR(p.normal.norm(), 1, 1e-12);
    EXPECT_LT(p.normal.dot(p.point), 0);
  }
  EXPECT_GT(oriented, static_cast<int>(0.9 * static_cast<double>(points.size())));
}

TEST(MatchLines, FindsTheMotionBetweenTwoScans) {
  testing::Scanner scanner;
  scanner.sigma = 0.003;
  const SE3 T = SE3::planar(0.3, -0.2, 0.2);
  const PointMap map(oriented_points(scanner.scan(testing::room(), SE3(), 0)));
  const auto scan = oriented_points(scanner.scan(testing::room(), T, 0));
  const LineMatch match = match_lines(map, scan, {});
  EXPECT_TRUE(match.converged);
  EXPECT_NEAR(match.T_map_scan.x, 0.3, 0.004);
  EXPECT_NEAR(match.T_map_scan.y, -0.2, 0.004);
  EXPECT_NEAR(match.T_map_scan.yaw, 0.2, 0.002);
  EXPECT_EQ(match.unknown_directions, 0);
  EXPECT_GT(match.matched, 0.9);
}

TEST(MatchLines, OneWallLeavesTheDirectionAlongItAlone) {
  testing::Scanner scanner;
  scanner.fov = M_PI / 2;
  const std::vector<testing::Wall> wall{{{2, -50}, {2, 50}}};
  const PointMap map(oriented_points(scanner.scan(wall, SE3(), 0)));
  const auto scan = oriented_points(scanner.scan(wall, SE3::planar(0.1, 0.3, 0.05), 0));
  const LineMatch match = match_lines(map, scan, {0, 0.7, 0});
  EXPECT_EQ(match.unknown_directions, 1);
  EXPECT_NEAR(match.T_map_scan.x, 0.1, 0.01);
  EXPECT_NEAR(match.T_map_scan.yaw, 0.05, 0.01);
  EXPECT_NEAR(match.T_map_scan.y, 0.7, 0.05);
}

TEST(MatchLines, NothingToMatchReturnsTheStart) {
  const LineMatch match = match_lines(PointMap(), {}, {1, 2, 3});
  EXPECT_EQ(match.T_map_scan.x, 1);
  EXPECT_EQ(match.unknown_directions, 3);
  EXPECT_FALSE(match.converged);
}

}  // namespace
}  // namespace lamina
