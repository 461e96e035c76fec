// Things that came where scans before saw through, and what odometry makes of them.
#include <gtest/gtest.h>

#include <lamina/frontend/motion/seen_through.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

using testing::guess;
using testing::Scanner;
using testing::Wall;

std::vector<OrientedPoint> points_of(const std::vector<Wall>& walls, const SE3& T_world_body) {
  Scanner scanner;
  return oriented_points(scanner.scan(walls, T_world_body, 0), {});
}

std::vector<Wall> with_box(std::vector<Wall> walls, double x, double y, double half) {
  const Eigen::Vector2d a(x - half, y - half), b(x + half, y - half), c(x + half, y + half),
      d(x - half, y + half);
  walls.insert(walls.end(), {{a, b}, {b, c}, {c, d}, {d, a}});
  return walls;
}

TEST(SeenThrough, WhatCameIsLeftOutAndWhatStoodThereIsNot) {
  std::vector<SightFan> fans;
  for (int i = 0; i < 4; ++i) {
    const SE3 T = SE3::planar(0.3 * i, 0, 0);
    fans.push_back(sight_fan(points_of(testing::room(), T), {0, 0}, planar_part(T)));
  }
  const SE3 here = SE3::planar(1.2, 0, 0);
  const auto left = [&](const std::vector<OrientedPoint>& points, const std::vector<SightFan>& by) {
    return without(points, seen_through(points, by, planar_part(here), 0.15)).size();
  };
  const auto as_before = points_of(testing::room(), here);
  EXPECT_EQ(left(as_before, fans), as_before.size());
  const auto came = points_of(with_box(testing::room(), 2.5, -0.7, 0.2), here);
  int on_box = 0;
  for (const OrientedPoint& p : came) {
    on_box += (planar_part(here) * p.point - Eigen::Vector2d(2.5, -0.7)).norm() < 0.35;
  }
  ASSERT_GT(on_box, 20);
  EXPECT_EQ(left(came, fans), came.size() - static_cast<std::size_t>(on_box));
  // One fan alone may have looked past an edge.
  EXPECT_EQ(left(came, {fans[0]}), came.size());
}

TEST(SeenThrough, CostIsLeastWhereTheScanFitsAndCountsThePrior) {
  const PointMap map(points_of(testing::room(), SE3()));
  const auto scan = points_of(testing::room(), SE3());
  PlanarPrior prior;
  const double there = match_cost(map, scan, {0, 0, 0}, prior, {});
  for (const PlanarPose off : {PlanarPose{0.05, 0, 0}, PlanarPose{0, -0.05, 0},
                               PlanarPose{0, 0, 0.02}, PlanarPose{3, 0, 0}}) {
    EXPECT_GT(match_cost(map, scan, off, prior, {}), there + 10);
  }
  prior.T_map_scan = {0.1, 0, 0};
  prior.information = Eigen::Vector3d(1e4, 1e4, 1e4).asDiagonal();
  EXPECT_NEAR(match_cost(map, scan, {0, 0, 0}, prior, {}), there + 50, 1e-9);
  prior.robust = true;
  EXPECT_LT(match_cost(map, scan, {0, 0, 0}, prior, {}), there + 50);
}

// How far scans and right wheels say a robot drove down a bare corridor while someone overtakes it.
double driven_beside_a_walker(double walker_from, double walker_step) {
  constexpr double kStep = 0.11;
  ScanOdometry odometry;
  Scanner scanner;
  scanner.sigma = 0.015;
  SE3 T;
  for (int i = 0; i < 60; ++i) {
    const double x = kStep * i;
    const auto walls = with_box(testing::corridor(), walker_from + walker_step * i, 0.65, 0.15);
    std::optional<MotionGuess> g;
    if (i > 0) g = guess(SE3::planar(kStep, 0, 0), 0.017, 0.017);
    T = T *
        odometry.process(scanner.scan(walls, SE3::planar(x, 0, 0), 0.125 * i), g).T_prev_curr_body;
  }
  return T.translation().x();
}

TEST(SeenThrough, PeopleWhoWalkAlongDoNotLeadTheRobot) {
  for (const double step : {0.19, 0.25, 0.3}) {
    EXPECT_NEAR(driven_beside_a_walker(0.5 - 20 * (step - 0.11), step), 59 * 0.11, 0.1) << step;
  }
}

// Wheels that lose 0.4 m once: the end of the corridor is nearer than they say, and has not come.
TEST(SeenThrough, TheEndOfACorridorTellsOfWheelsThatFellShort) {
  const std::vector<Wall> walls{
      {{-20, -1.2}, {7, -1.2}}, {{-20, 1.2}, {7, 1.2}}, {{7, -1.2}, {7, 1.2}}};
  ScanOdometry odometry;
  Scanner scanner;
  SE3 T;
  for (int i = 0; i < 9; ++i) {
    std::optional<MotionGuess> g;
    if (i > 0) g = guess(SE3::planar(i == 6 ? 0.2 : 0.6, 0, 0), 0.02, 0.02);
    T = T * odometry.process(scanner.scan(walls, SE3::planar(0.6 * i, 0, 0), 0.5 * i), g)
                .T_prev_curr_body;
  }
  EXPECT_NEAR(T.translation().x(), 4.8, 0.1);
}

TEST(SeenThrough, PeopleWhoComeAcrossDoNotLeadTheRobot) {
  EXPECT_NEAR(driven_beside_a_walker(8, -0.15), 59 * 0.11, 0.1);
}

}  // namespace
}  // namespace lamina
