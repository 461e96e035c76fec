// Where the robot drove, noise leaves nothing open; what blocks stays, and what was not driven
// over.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/grid/driven_ground.hpp>

#include "grid/terrain.hpp"

namespace lamina {
namespace {

Trajectory along_x(double z) {
  Trajectory path;
  for (int k = 0; k <= 10; ++k) {
    path.add(Timestamp::from_nanoseconds(std::int64_t{k} * 1'000'000'000),
             SE3::from_translation({-1 + 0.2 * k, 0, z}));
  }
  return path;
}

struct Floor {
  PlanarMap map;
  // Each square a centimetre above or below its neighbours, and not sure of it.
  explicit Floor(double sigma = 0.02) {
    test::add_path(map, {-1, 0, 0}, {1, 0, 0});
    test::add_floor(
        map, {-2, -1}, {2, 1},
        [](double x, double y) {
          const double odd = std::abs(std::floor(10 * x) + std::floor(10 * y));
          return std::fmod(odd, 2) < 0.5 ? 0.005 : -0.005;
        },
        sigma);
  }
  NavigabilityGrid drawn(const Trajectory& path) {
    Rasterizer rasterizer{RasterOptions{}};
    rasterizer.update(map);
    const auto driven = driven_over(rasterizer, path);
    NavigabilityGrid grid = std::move(rasterizer).take_grid();
    free_cells(grid, driven, 0.95);
    return grid;
  }
};

TEST(DrivenGround, WhatNoiseLeavesOpenIsFreeWhereTheRobotDrove) {
  Floor floor;
  ASSERT_FALSE(test::at(rasterize(floor.map), 0.5, 0.1).known());
  const NavigabilityGrid grid = floor.drawn(along_x(0));
  for (double x = -1; x < 1; x += 0.05) {
    for (double y = -0.2; y < 0.2; y += 0.05) {
      EXPECT_EQ(test::at(grid, x, y).navigability, 1.0F) << x << " " << y;
      EXPECT_EQ(test::at(grid, x, y).confidence, 0.95F);
    }
    EXPECT_FALSE(test::at(grid, x, 0.4).known());
    EXPECT_FALSE(test::at(grid, x, -0.4).known());
  }
}

TEST(DrivenGround, ACarriedCameraDrivesOverNothing) {
  Floor floor;
  EXPECT_FALSE(test::at(floor.drawn(along_x(0.9)), 0.5, 0.1).known());
}

TEST(DrivenGround, WhatBlocksStays) {
  Floor floor(0);
  test::add_wall(floor.map, {0, -0.5}, {0, 0.5}, 0, 1);
  const NavigabilityGrid grid = floor.drawn(along_x(0));
  EXPECT_EQ(test::at(grid, 0.01, 0.01).navigability, 0.0F);
}

// A ledge beside the way: how near it is nobody knows to the cell, and noise is not the reason.
TEST(DrivenGround, BesideALedgeOnlyWhatIsUnderTheRobotIsFree) {
  PlanarMap map;
  test::add_path(map, {-1, 0, 0}, {1, 0, 0});
  test::add_floor(map, {-2, -1}, {2, 1}, [](double, double y) { return y < 0.2 ? 0 : -0.1; });
  Rasterizer rasterizer{RasterOptions{}};
  rasterizer.update(map);
  for (const DrivenCell& driven : driven_over(rasterizer, along_x(0)))
    EXPECT_LT(std::abs(center_of(driven.cell, 0.05).y()), 0.11);
}

}  // namespace
}  // namespace lamina
