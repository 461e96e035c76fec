// What counts as falsely free and falsely blocked, on small literal grids.
#include <gtest/gtest.h>

#include <lamina/apps/grid_error.hpp>

namespace lamina::apps {
namespace {

constexpr int kSide = 40;

// Level free ground at 0, all of it known.
NavigabilityGrid ground() {
  NavigabilityGrid grid(0.05);
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) grid.at_or_new({i, j}) = {0.0F, 0.0F, 1.0F, 1.0F};
  }
  return grid;
}

void block(NavigabilityGrid& grid, int i, int j, float height) {
  grid.at_or_new({i, j}) = {height, 0.0F, 0.0F, 1.0F};
}

TEST(GridErrors, EqualGridsHaveNone) {
  NavigabilityGrid truth = ground();
  block(truth, 20, 20, 0.5F);
  const GridErrors e = grid_errors(truth, truth);
  EXPECT_EQ(e.compared, kSide * kSide);
  EXPECT_EQ(e.false_free + e.false_blocked + e.blocked_edges + e.unknown_flat, 0);
  EXPECT_EQ(e.height_rms_m, 0);
}

TEST(GridErrors, FalselyFreeIsToldApartByPitsAndDepth) {
  NavigabilityGrid truth = ground(), map = ground();
  block(truth, 10, 10, 0.3F);
  for (int j = 20; j < 25; ++j) {
    for (int i = 20; i < 25; ++i) block(truth, i, j, NavigabilityCell::kUnknown);
  }
  const GridErrors e = grid_errors(map, truth);
  EXPECT_EQ(e.false_free, 26);
  EXPECT_EQ(e.false_free_pits, 25);
  EXPECT_EQ(e.false_free_deep, 9);  // the pit's inner 3 x 3
  EXPECT_NEAR(e.false_free_share, 26.0 / (kSide * kSide), 1e-12);
}

TEST(GridErrors, FalselyBlockedCountsOnFlatFloorAwayFromEdges) {
  NavigabilityGrid truth = ground(), map = ground();
  for (NavigabilityGrid* grid : {&truth, &map}) block(*grid, 10, 10, 0.3F);
  block(map, 12, 10, 0.3F);  // 0.1 m from the true edge
  block(map, 13, 10, 0.3F);  // beyond
  map.at_or_new({30, 30}).navigability = NavigabilityCell::kUnknown;
  const GridErrors e = grid_errors(map, truth);
  EXPECT_EQ(e.blocked_edges, 1);
  EXPECT_EQ(e.false_blocked, 1);
  EXPECT_EQ(e.unknown_flat, 1);
  // Two cells at the border of the truth and those around the obstacle are no flat floor.
  EXPECT_EQ(e.flat_floor, (kSide - 4) * (kSide - 4) - 25);
}

}  // namespace
}  // namespace lamina::apps
