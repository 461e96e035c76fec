// What counts as falsely free and falsely blocked, on small literal grids.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/pipeline/evaluation/grid_error.hpp>

namespace lamina {
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
  EXPECT_EQ(e.unknown_ends, 0);
  // Two cells at the border of the truth and those around the obstacle are no flat floor.
  EXPECT_EQ(e.flat_floor, (kSide - 4) * (kSide - 4) - 25);
}

TEST(GridErrors, UnknownBesideWhatNobodySawIsCountedApart) {
  NavigabilityGrid truth = ground(), map = ground();
  map.at_or_new({10, 10}).navigability = NavigabilityCell::kUnknown;
  map.at_or_new({20, 20}).navigability = NavigabilityCell::kUnknown;
  map.at_or_new({21, 20}) = NavigabilityCell{};
  const GridErrors e = grid_errors(map, truth);
  EXPECT_EQ(e.unknown_flat, 2);
  EXPECT_EQ(e.unknown_ends, 1);
}

TEST(GridErrors, HeightsNearThePathAreCountedApart) {
  NavigabilityGrid truth(0.05), map(0.05);
  for (int i = 0; i < 120; ++i) {
    truth.at_or_new({i, 0}) = {0.0F, 0.0F, 1.0F, 1.0F};
    map.at_or_new({i, 0}) = {i < 60 ? 0.001F : 0.003F, 0.0F, 1.0F, 1.0F};
  }
  Trajectory path;  // cells up to 2.975 m have it within 3 m
  path.add(Timestamp::from_nanoseconds(0), SE3(SO3(), {0, 0.025, 0}));
  const GridErrors e = grid_errors(map, truth, SE3(), path);
  EXPECT_EQ(e.near_heights, 60);
  EXPECT_NEAR(e.near_height_rms_m, 0.001, 1e-7);
  EXPECT_NEAR(e.height_rms_m, std::sqrt(5.0) * 1e-3, 1e-7);
  EXPECT_EQ(grid_errors(map, truth).near_heights, 0);
}

TEST(PathErrors, PlacesAndTheMiddlesBetweenAreLookedAt) {
  NavigabilityGrid truth = ground();
  EXPECT_EQ(path_errors({{0.5, 0.5}, {1.5, 0.5}}, truth).not_free, 0);
  block(truth, 20, 10, 0.3F);  // 1.0 to 1.05 m: the middle
  const PathErrors e = path_errors({{0.5, 0.5}, {1.5, 0.5}, {9, 9}}, truth);
  EXPECT_EQ(e.places, 5);
  EXPECT_EQ(e.not_free, 3);  // the middle, the place outside, and the middle on the way there
}

}  // namespace
}  // namespace lamina
