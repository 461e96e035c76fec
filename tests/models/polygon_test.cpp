// Outlines: area, point tests, clipping, simplification, at literal shapes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <lamina/models/polygon.hpp>

#include "support/matchers.hpp"
#include "support/random.hpp"

namespace lamina::test {
namespace {

using Vertices = std::vector<Eigen::Vector2d>;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Polygon square(double side, const Eigen::Vector2d& low = {0, 0}) {
  return *Polygon::from_vertices({low, low + Eigen::Vector2d(side, 0),
                                  low + Eigen::Vector2d(side, side),
                                  low + Eigen::Vector2d(0, side)});
}

// An L: a 2 x 2 square without its upper right quarter.
Polygon ell() { return *Polygon::from_vertices({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}); }

TEST(Polygon, RunsCounterClockwise) {
  const Polygon clockwise = *Polygon::from_vertices({{0, 0}, {0, 1}, {1, 1}, {1, 0}});
  EXPECT_NEAR(clockwise.area(), 1, 1e-15);
  EXPECT_EQ(clockwise.vertices().front(), Eigen::Vector2d(1, 0));
}

TEST(Polygon, DropsRepeatedVertices) {
  const auto polygon = Polygon::from_vertices({{0, 0}, {0, 0}, {1, 0}, {1, 1}, {1, 1}, {0, 0}});
  ASSERT_TRUE(polygon);
  EXPECT_EQ(polygon->vertices().size(), 3u);
}

TEST(Polygon, BadInputIsNullopt) {
  EXPECT_FALSE(Polygon::from_vertices({}));
  EXPECT_FALSE(Polygon::from_vertices({{0, 0}, {1, 0}}));
  EXPECT_FALSE(Polygon::from_vertices({{0, 0}, {1, 0}, {0, 0}}));
  EXPECT_FALSE(Polygon::from_vertices({{0, 0}, {1, 0}, {kNaN, 1}}));
  EXPECT_FALSE(Polygon::from_vertices({{0, 0}, {1, 1}, {2, 2}})) << "no area";
  EXPECT_FALSE(Polygon::from_vertices({{0, 0}, {0.1, 0.3}, {0.7, 2.1}})) << "none to rounding";
  EXPECT_FALSE(Polygon::convex_hull(Vertices{{0, 0}, {1, 1}, {2, 2}, {3, 3}}));
  EXPECT_FALSE(Polygon::convex_hull(Vertices{{0, 0}, {1, 1}, {kNaN, 2}}));
  EXPECT_TRUE(Polygon().empty());
  EXPECT_FALSE(Polygon().contains({0, 0}));
}

TEST(Polygon, AreaAndCentroid) {
  EXPECT_NEAR(ell().area(), 3, 1e-14);
  EXPECT_THAT(ell().centroid(), IsNear(Eigen::Vector2d(2.5 / 3, 2.5 / 3), 1e-14));
  const Polygon far = square(0.1, {5000, -5000});
  EXPECT_NEAR(far.area(), 0.01, 1e-12);
  EXPECT_THAT(far.centroid(), IsNear(Eigen::Vector2d(5000.05, -4999.95), 1e-9));
}

TEST(Polygon, ContainsInsideAndBorder) {
  const Polygon shape = ell();
  EXPECT_TRUE(shape.contains({0.5, 0.5}));
  EXPECT_TRUE(shape.contains({1.5, 0.5}));
  EXPECT_FALSE(shape.contains({1.5, 1.5})) << "the missing quarter";
  EXPECT_FALSE(shape.contains({-0.1, 0.5}));
  EXPECT_FALSE(shape.contains({3, 1})) << "level with a vertex";
  for (const auto& vertex : shape.vertices()) EXPECT_TRUE(shape.contains(vertex));
  EXPECT_TRUE(shape.contains({1, 1.5})) << "on the border";
  EXPECT_FALSE(shape.contains({1 + 1e-9, 1.5}));
}

TEST(Polygon, SignedDistance) {
  EXPECT_NEAR(ell().signed_distance({0.5, 1.5}), -0.5, 1e-15);
  EXPECT_NEAR(ell().signed_distance({2, 2}), 1, 1e-15);
  EXPECT_NEAR(ell().signed_distance({-3, -4}), 5, 1e-15);
  EXPECT_NEAR(ell().signed_distance({1, 1}), 0, 1e-15);
}

TEST(Polygon, ConvexHull) {
  const Polygon hull = *Polygon::convex_hull(
      Vertices{{0, 0}, {1, 0}, {2, 0}, {2, 2}, {1, 1}, {0, 2}, {0.5, 0.5}, {0, 0}});
  EXPECT_EQ(hull.vertices().size(), 4u) << "points on its sides are left out";
  EXPECT_NEAR(hull.area(), 4, 1e-15);
  Random random(1);
  Vertices cloud;
  for (int i = 0; i < 200; ++i) cloud.emplace_back(random.normal(), random.normal());
  const Polygon around = *Polygon::convex_hull(cloud);
  for (const auto& point : cloud) EXPECT_TRUE(around.contains(point));
}

TEST(Polygon, Clipped) {
  const auto overlap = square(2).clipped(square(2, {1, 1}));
  ASSERT_TRUE(overlap);
  EXPECT_NEAR(overlap->area(), 1, 1e-14);
  EXPECT_THAT(overlap->centroid(), IsNear(Eigen::Vector2d(1.5, 1.5), 1e-14));
  EXPECT_NEAR(square(1, {0.5, 0.5}).clipped(square(2))->area(), 1, 1e-14) << "all inside";
  EXPECT_NEAR(square(4, {-1, -1}).clipped(square(2))->area(), 4, 1e-14) << "all around";
  EXPECT_FALSE(square(1).clipped(square(1, {3, 3})));
  EXPECT_FALSE(square(1).clipped(square(1, {1, 0}))) << "touching has no area";
  EXPECT_NEAR(ell().clipped(square(1.5, {0.5, 0.5}))->area(), 1.25, 1e-14) << "concave";
}

TEST(Polygon, ClippedAreasAddUp) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    Vertices cloud;
    for (int k = 0; k < 8; ++k) cloud.emplace_back(random.normal(), random.normal());
    const Polygon shape = *Polygon::convex_hull(cloud);
    double sum = 0;
    for (const auto& corner : Vertices{{0, 0}, {-9, 0}, {0, -9}, {-9, -9}}) {
      const auto part = shape.clipped(square(9, corner));
      if (part) sum += part->area();
    }
    EXPECT_NEAR(sum, shape.area(), 1e-12);
  }
}

TEST(Polygon, SimplifiedStaysWithinTolerance) {
  Vertices circle;
  for (int i = 0; i < 360; ++i) {
    circle.emplace_back(std::cos(i * M_PI / 180), std::sin(i * M_PI / 180));
  }
  const Polygon round = *Polygon::from_vertices(circle);
  const Polygon simple = round.simplified(0.01);
  EXPECT_LT(simple.vertices().size(), 40u);
  for (const auto& v : circle) EXPECT_LE(std::abs(simple.signed_distance(v)), 0.01 + 1e-12);
  for (const auto& v : simple.vertices()) EXPECT_NEAR(v.norm(), 1, 1e-15) << "vertices stay";
  EXPECT_EQ(square(1).simplified(100).vertices().size(), 4u) << "never less than an area";
}

}  // namespace
}  // namespace lamina::test
