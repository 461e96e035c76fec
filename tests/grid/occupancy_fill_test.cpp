// Two grids of one ground say the same of it.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/grid/occupancy_fill.hpp>

namespace lamina {
namespace {

constexpr float kUnknown = NavigabilityCell::kUnknown;

// Marks (occupied) the cells of row 0 from i = 0 to 9, seen from i = -20.
OccupancyGrid marked() {
  OccupancyGrid grid;
  for (int k = 0; k < 5; ++k) {
    for (int i = 0; i < 10; ++i) {
      grid.add(SE3(SO3(), {-1, 0.025, 0.4}), {{{1 + 0.05 * i + 0.025, 0}, 0.001, true}});
    }
  }
  return grid;
}

// Only the last of these cells is certainly marked: rays to it cleared the others.
TEST(OccupancyFill, FreeGroundIsNoObstacle) {
  OccupancyGrid occupancy = marked();
  ASSERT_GT(occupancy.probability({9, 0}), 0.65F);
  NavigabilityGrid grid(0.05);
  grid.at_or_new({9, 0}) = {0.05F, 0.08F, 0.9F, 0.99F};
  grid.at_or_new({20, 0}) = {0.1F, 0.08F, 0.9F, 0.99F};
  agree_with_ground(occupancy, nullptr, grid);
  EXPECT_LT(occupancy.probability({9, 0}), 0.196F);
  EXPECT_LT(occupancy.probability({20, 0}), 0.196F) << "seen by images alone";
}

TEST(OccupancyFill, WhatAScannerFoundStays) {
  OccupancyGrid occupancy = marked();
  const OccupancyGrid scanners = marked();
  NavigabilityGrid grid(0.05);
  grid.at_or_new({9, 0}) = {0, 0, 1, 1};
  agree_with_ground(occupancy, &scanners, grid);
  EXPECT_GT(occupancy.probability({9, 0}), 0.65F);
}

TEST(OccupancyFill, OpenGroundIsUnknownUnlessSomethingStandsNear) {
  OccupancyGrid specks = marked(), step = marked(), blocked = marked();
  NavigabilityGrid grid(0.05);
  OccupancyGrid unseen = marked();
  agree_with_ground(unseen, nullptr, grid);
  EXPECT_TRUE(std::isnan(unseen.probability({9, 0}))) << "the map has nothing there";
  EXPECT_LT(unseen.probability({-5, 0}), 0.196F) << "what was free stays";
  grid.at_or_new({9, 0}) = {0.01F, 0, kUnknown, kUnknown};
  agree_with_ground(specks, nullptr, grid);
  EXPECT_TRUE(std::isnan(specks.probability({9, 0})));
  grid.at_or_new({11, 1}) = {0.05F, 0, 0, 0.99F};
  agree_with_ground(step, nullptr, grid);
  EXPECT_GT(step.probability({9, 0}), 0.65F);
  grid.at_or_new({9, 0}) = {0.5F, 0, 0, 0.99F};
  agree_with_ground(blocked, nullptr, grid);
  EXPECT_GT(blocked.probability({9, 0}), 0.65F);
}

}  // namespace
}  // namespace lamina
