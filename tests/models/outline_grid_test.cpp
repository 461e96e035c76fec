// The union of what was seen of a plane, drawn as text.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include <lamina/models/polygon.hpp>

#include "support/matchers.hpp"
#include "support/random.hpp"

namespace lamina::test {
namespace {

using Cell = OutlineGrid::Cell;

// Rows of text, the last at j = 0; '#' is a seen cell. Cells of 1 m.
OutlineGrid drawn(const std::vector<std::string>& rows) {
  OutlineGrid grid(1.0);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t i = 0; i < rows[r].size(); ++i) {
      if (rows[r][i] == '#') {
        grid.add_cell({static_cast<int>(i), static_cast<int>(rows.size() - 1 - r)});
      }
    }
  }
  return grid;
}

TEST(OutlineGrid, KnowsItsCells) {
  OutlineGrid grid(0.1);
  EXPECT_TRUE(grid.empty());
  grid.add(Eigen::Vector2d(0.05, 0.05));
  grid.add(Eigen::Vector2d(0.09, 0.01));
  grid.add(Eigen::Vector2d(-0.01, -0.01));
  EXPECT_EQ(grid.size(), 2u);
  EXPECT_THAT(grid.cells(), testing::ElementsAre(Cell(-1, -1), Cell(0, 0)));
  EXPECT_TRUE(grid.contains({0.03, 0.03}));
  EXPECT_FALSE(grid.contains({0.11, 0.03}));
  EXPECT_NEAR(grid.area(), 0.02, 1e-15);
}

TEST(OutlineGrid, CellsAreAscendingOverTiles) {
  OutlineGrid grid(1.0);
  Random random(1);
  for (int i = 0; i < 300; ++i) grid.add_cell({random.integer(-20, 20), random.integer(-20, 20)});
  const auto cells = grid.cells();
  EXPECT_EQ(cells.size(), grid.size());
  EXPECT_TRUE(std::is_sorted(cells.begin(), cells.end()));
  EXPECT_EQ(std::adjacent_find(cells.begin(), cells.end()), cells.end());
  for (const Cell& cell : cells) EXPECT_TRUE(grid.contains_cell(cell));
}

TEST(OutlineGrid, BadPointsAreIgnored) {
  OutlineGrid grid(0.1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  grid.add(Eigen::Vector2d(nan, 0));
  grid.add(Eigen::Vector2d(0, inf));
  grid.add(Eigen::Vector2d(1e300, 0));
  grid.add_stroke({0, 0}, {nan, 0});
  grid.add(Polygon());
  EXPECT_TRUE(grid.empty());
  EXPECT_FALSE(grid.contains({nan, 0}));
  EXPECT_TRUE(grid.outlines().empty());
}

TEST(OutlineGrid, TracesASquare) {
  OutlineGrid grid(0.1);
  grid.add(*Polygon::from_vertices({{0, 0}, {1, 0}, {1, 1}, {0, 1}}));
  EXPECT_EQ(grid.size(), 100u);
  const auto outlines = grid.outlines();
  ASSERT_EQ(outlines.size(), 1u);
  EXPECT_EQ(outlines[0].vertices().size(), 4u);
  EXPECT_NEAR(outlines[0].area(), 1.0, 1e-12);
}

TEST(OutlineGrid, KeepsAConcaveOutline) {
  const auto outlines = drawn({"####....",  //
                               "####....",  //
                               "########",  //
                               "########"})
                            .outlines();
  ASSERT_EQ(outlines.size(), 1u);
  EXPECT_NEAR(outlines[0].area(), 24, 1e-12);
  EXPECT_EQ(outlines[0].vertices().size(), 6u);
}

TEST(OutlineGrid, PartsAreLargestFirstAndHolesAreNotTold) {
  const auto outlines = drawn({"##.....####",  //
                               "##.....#..#",  //
                               ".......####"})
                            .outlines(0);
  ASSERT_EQ(outlines.size(), 2u);
  EXPECT_NEAR(outlines[0].area(), 12, 1e-12);
  EXPECT_NEAR(outlines[1].area(), 4, 1e-12);
}

TEST(OutlineGrid, CornersAloneDoNotConnect) {
  const auto outlines = drawn({"##..",  //
                               "##..",  //
                               "..##",  //
                               "..##"})
                            .outlines(0);
  ASSERT_EQ(outlines.size(), 2u);
  EXPECT_NEAR(outlines[0].area() + outlines[1].area(), 8, 1e-12);
}

TEST(OutlineGrid, AHoleThatTouchesTheBorderByACorner) {
  // Outside reaches the hole only over a corner, where cells are connected the other way round.
  const auto outlines = drawn({"####",  //
                               "##.#",  //
                               "#.##",  //
                               "####"})
                            .outlines(0);
  ASSERT_EQ(outlines.size(), 1u);
  EXPECT_NEAR(outlines[0].area(), 16, 1e-12);
}

TEST(OutlineGrid, ClosesGaps) {
  const OutlineGrid gap = drawn({"###.###",  //
                                 "###.###",  //
                                 "###.###"});
  EXPECT_EQ(gap.outlines(0).size(), 2u);
  const auto closed = gap.outlines(1);
  ASSERT_EQ(closed.size(), 1u);
  EXPECT_NEAR(closed[0].area(), 21, 1e-12);
}

TEST(OutlineGrid, ASlantingBorderIsStraight) {
  OutlineGrid grid(0.05);
  const Polygon diamond = *Polygon::from_vertices({{2.01, 0}, {0, 2.01}, {-2.01, 0}, {0, -2.01}});
  grid.add(diamond);
  const auto outlines = grid.outlines();
  ASSERT_EQ(outlines.size(), 1u);
  EXPECT_NEAR(outlines[0].area(), diamond.area(), 0.05 * diamond.area());
  EXPECT_LE(outlines[0].vertices().size(), 16u);
}

TEST(OutlineGrid, PolygonCellsAreThoseWhoseCentreIsInside) {
  Random random(2);
  for (int n = 0; n < 20; ++n) {
    std::vector<Eigen::Vector2d> star;
    const int corners = 3 + n % 9;
    for (int k = 0; k < corners; ++k) {
      const double angle = 2 * M_PI * k / corners, r = random.uniform(0.2, 1.5);
      star.emplace_back(r * std::cos(angle), r * std::sin(angle));
    }
    const Polygon polygon = *Polygon::from_vertices(star);
    OutlineGrid grid(0.07);
    grid.add(polygon);
    for (int i = -25; i < 25; ++i) {
      for (int j = -25; j < 25; ++j) {
        const Eigen::Vector2d centre((i + 0.5) * 0.07, (j + 0.5) * 0.07);
        EXPECT_EQ(grid.contains_cell({i, j}), polygon.contains(centre)) << i << " " << j;
      }
    }
  }
}

TEST(OutlineGrid, StrokePassesEveryCellOnItsWay) {
  Random random(3);
  for (int n = 0; n < 50; ++n) {
    const Eigen::Vector2d a(random.uniform(-1, 1), random.uniform(-1, 1));
    const Eigen::Vector2d b(random.uniform(-1, 1), random.uniform(-1, 1));
    OutlineGrid grid(0.1), sampled(0.1);
    grid.add_stroke(a, b);
    for (int k = 0; k <= 5000; ++k) sampled.add(Eigen::Vector2d(a + (b - a) * (k / 5000.0)));
    for (const Cell& cell : sampled.cells()) EXPECT_TRUE(grid.contains_cell(cell));
    EXPECT_LE(grid.size(), sampled.size() + 1) << "and no others, but for a corner cut too finely";
  }
  OutlineGrid straight(1.0);
  straight.add_stroke({0.5, 0.5}, {0.5, -3.5});
  EXPECT_EQ(straight.size(), 5u);
  straight.add_stroke({2.5, 2.5}, {2.5, 2.5});
  EXPECT_EQ(straight.size(), 6u);
}

TEST(OutlineGrid, MergeIsTheUnion) {
  Random random(4);
  OutlineGrid a(0.1), b(0.1), both(0.1);
  for (int i = 0; i < 400; ++i) {
    const Cell cell{random.integer(-20, 20), random.integer(-20, 20)};
    (i % 2 ? a : b).add_cell(cell);
    both.add_cell(cell);
  }
  a.merge(b);
  EXPECT_EQ(a.cells(), both.cells());
  EXPECT_EQ(a.size(), both.size());
}

TEST(OutlineGrid, MergeOfAnotherCellSizeLeavesNoGaps) {
  OutlineGrid coarse(0.3), fine(0.1);
  coarse.add(*Polygon::from_vertices({{0, 0}, {3, 0}, {3, 3}, {0, 3}}));
  fine.merge(coarse);
  EXPECT_EQ(fine.size(), 900u);
  OutlineGrid back(0.3);
  back.merge(fine);
  EXPECT_EQ(back.cells(), coarse.cells());
}

TEST(OutlineGrid, GrowsAsAPlaneIsSeen) {
  OutlineGrid wall(0.1);
  double before = 0;
  for (int k = 0; k < 5; ++k) {
    OutlineGrid seen(0.1);
    const double x = k;
    seen.add(*Polygon::from_vertices({{x, 0}, {x + 1.5, 0}, {x + 1.5, 2}, {x, 2}}));
    wall.merge(seen);
    EXPECT_GT(wall.area(), before);
    before = wall.area();
  }
  ASSERT_EQ(wall.outlines().size(), 1u);
  EXPECT_NEAR(wall.outlines()[0].area(), 5.5 * 2, 1e-9);
}

}  // namespace
}  // namespace lamina::test
