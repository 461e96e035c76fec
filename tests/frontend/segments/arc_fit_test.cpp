// Circles through noisy returns.
#include <gtest/gtest.h>

#include <lamina/frontend/segments/arc_fit.hpp>
#include <numeric>

#include "frontend/segments/scan_maker.hpp"

namespace lamina {
namespace {

// Returns of a wall of curvature `bend` (towards the scanner), 2 m ahead, 1.5 m to each side.
ScanPoints bent_wall(double bend, std::mt19937& random) {
  test::ScanMaker maker;
  maker.beams = 121;
  maker.fov = 2 * std::atan2(1.5, 2.0);
  maker.noise.range_sigma = 0.02;
  std::vector<test::Wall> walls;
  for (int i = -40; i < 40; ++i) {
    const auto at = [&](double y) { return Eigen::Vector2d(2 - 0.5 * bend * y * y, y); };
    walls.push_back({at(0.05 * i), at(0.05 * (i + 1))});
  }
  ScanPoints points;
  points.load(maker.scan(walls, random), {});
  return points;
}

TEST(FitArc, CurvatureOfAWallIsAsSureAsItSays) {
  std::mt19937 random(6);
  constexpr int kRuns = 100;
  constexpr double kBend = 0.15;
  double sum = 0, squares = 0, cost = 0;
  for (int k = 0; k < kRuns; ++k) {
    const ScanPoints points = bent_wall(kBend, random);
    std::vector<int> all(static_cast<std::size_t>(points.size()));
    std::iota(all.begin(), all.end(), 0);
    const auto arc = fit_arc(points, all, 16);
    ASSERT_TRUE(arc.has_value());
    const double off = arc->curvature - kBend;
    sum += off;
    squares += off * off * arc->information;
    cost += arc->cost / (points.size() - 3);
  }
  EXPECT_NEAR(sum / kRuns, 0, 0.01);
  EXPECT_NEAR(squares / kRuns, 1, 0.35);
  EXPECT_NEAR(cost / kRuns, 1, 0.1);
}

TEST(FitArc, NeverWorseThanALine) {
  std::mt19937 random(7);
  for (int k = 0; k < 100; ++k) {
    const ScanPoints points = bent_wall(0, random);
    std::vector<int> all(static_cast<std::size_t>(points.size()));
    std::iota(all.begin(), all.end(), 0);
    const auto arc = fit_arc(points, all, 1e9);
    ASSERT_TRUE(arc.has_value());
    // The line's cost is of errors in inverse range, the arc's in range: they differ by a share.
    EXPECT_LT(arc->cost, 1.02 * points.sums(0, points.size()).cost());
  }
}

TEST(FitArc, TooFewReturnsAreNoCircle) {
  std::mt19937 random(8);
  const ScanPoints points = bent_wall(0.5, random);
  const std::vector<int> few{0, 1, 2, 3};
  EXPECT_FALSE(fit_arc(points, few, 16).has_value());
}

}  // namespace
}  // namespace lamina
