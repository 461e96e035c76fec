// Outlines in triangles: all of the area, nothing beside it, and always an end.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include <lamina/models/ear_clipping.hpp>
#include <lamina/models/polygon.hpp>

namespace lamina::test {
namespace {

using Outline = std::vector<Eigen::Vector2d>;

double area_of(const Outline& v, const std::array<std::size_t, 3>& t) {
  const Eigen::Vector2d ab = v[t[1]] - v[t[0]], ac = v[t[2]] - v[t[0]];
  return 0.5 * (ab.x() * ac.y() - ab.y() * ac.x());
}

// The triangles cover the area, and their centres lie inside.
void expect_covered(const Outline& outline) {
  const Polygon polygon = *Polygon::from_vertices(outline);
  double area = 0;
  for (const auto& triangle : triangles_of(outline)) {
    const double own = area_of(outline, triangle);
    EXPECT_GT(own, 0);
    area += own;
    const Eigen::Vector2d centre =
        (outline[triangle[0]] + outline[triangle[1]] + outline[triangle[2]]) / 3;
    EXPECT_TRUE(polygon.contains(centre)) << centre.transpose();
  }
  EXPECT_NEAR(area, polygon.area(), 1e-9 * polygon.area());
}

TEST(EarClipping, ASquareIsTwoTriangles) {
  const Outline square{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  EXPECT_EQ(triangles_of(square).size(), 2U);
  expect_covered(square);
}

TEST(EarClipping, ConcaveOutlinesOfEitherDirection) {
  Outline comb{{0, 0}, {7, 0}, {7, 3}, {6, 3}, {6, 1}, {5, 1}, {5, 3},
               {4, 3}, {4, 1}, {3, 1}, {3, 3}, {2, 3}, {2, 1}, {0, 3}};
  expect_covered(comb);
  expect_covered({comb.rbegin(), comb.rend()});
}

TEST(EarClipping, StarsOfAllShapes) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> radius(0.2, 3);
  for (int n = 5; n < 60; n += 6) {
    Outline star;
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * M_PI * i / n;
      star.push_back(radius(random) * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
    expect_covered(star);
  }
}

TEST(EarClipping, VerticesOnALineAndOutlinesThatTouchThemselves) {
  expect_covered({{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}});
  // A ring cut open along an edge of no width.
  expect_covered({{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 1}, {1, 3}, {3, 3}, {3, 1}, {1, 1}});
}

TEST(EarClipping, EndsOnOutlinesThatCrossThemselves) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-1, 1);
  for (int trial = 0; trial < 20; ++trial) {
    Outline tangle;
    for (int i = 0; i < 40; ++i) tangle.emplace_back(place(random), place(random));
    EXPECT_LE(triangles_of(tangle).size(), 38U);
  }
}

TEST(EarClipping, NothingOfWhatIsNoOutline) {
  EXPECT_TRUE(triangles_of({}).empty());
  EXPECT_TRUE(triangles_of({{0, 0}, {1, 0}}).empty());
  EXPECT_TRUE(triangles_of({{0, 0}, {0, 0}, {0, 0}}).empty());
  EXPECT_TRUE(
      triangles_of({{0, 0}, {1, 0}, {1, std::numeric_limits<double>::quiet_NaN()}}).empty());
}

}  // namespace
}  // namespace lamina::test
