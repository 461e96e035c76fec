// Which of several level surfaces the grid takes for the floor.
#include <gtest/gtest.h>

#include <lamina/grid/rasterizer.hpp>

#include "grid/terrain.hpp"

namespace lamina {
namespace {

// A cupboard as high as the hand that carries a camera past it.
TEST(RasterFloor, ATopAtACarriedCamerasHeightIsNoFloor) {
  PlanarMap map;
  test::add_path(map, {-2, 0, 1.5}, {2, 0, 1.5});
  test::add_floor(map, {-3, -2}, {3, 2}, [](double, double) { return 0.0; });
  test::add_floor(map, {1.8, -0.3}, {2.4, 0.3}, [](double, double) { return 1.3; });
  Rasterizer rasterizer{RasterOptions{}};
  rasterizer.update(map);
  EXPECT_FALSE(rasterizer.floor_under_path());
  EXPECT_EQ(test::at(rasterizer.grid(), 0.025, 1.025).navigability, 1.0F);
  // One that stands there for most of the path is what a robot drives on.
  for (int i = 0; i < 20; ++i) test::add_path(map, {1.85, 0, 1.3}, {2.35, 0, 1.3});
  rasterizer.update(map);
  EXPECT_TRUE(rasterizer.floor_under_path());
}

// What the camera looked past lies between two parts of one floor: its own height tells nothing of
// where the floor is.
TEST(RasterFloor, FloorThatNothingJoinsToTheLargestIsNoPitUnderACarriedCamera) {
  const auto at_height = [](double z) {
    PlanarMap map;
    test::add_path(map, {-2, 0, 1.5}, {4, 0, 1.5});
    test::add_floor(map, {-3, -2}, {1, 2}, [](double, double) { return 0.0; });
    test::add_floor(map, {3, -1}, {6, 1}, [z](double, double) { return z; });
    return test::at(rasterize(map), 5.025, 0.025);
  };
  EXPECT_EQ(at_height(0).navigability, 1.0F);
  EXPECT_EQ(at_height(-0.015).navigability, 1.0F);
  // How two such parts lie to each other is no better known than the path between them.
  EXPECT_FALSE(at_height(-0.05).known());
  EXPECT_EQ(at_height(-0.4).navigability, 0.0F);
  EXPECT_EQ(at_height(-0.4).confidence, 1.0F);
}

// A platform of 12 cm: its surfels end where a camera 0.5 m high sees it too flat, single patches
// go on.
class RasterPlatform : public ::testing::Test {
 protected:
  RasterPlatform() {
    test::add_path(map_, {-2, 0, 0}, {-1, 0, 0});
    test::add_floor(map_, {-3, -2}, {-0.3, 2}, [](double, double) { return 0.0; });
    test::add_plate(map_, {0, -1}, {2, 1}, 0.12, true);
    map_.planes.back().id = 7;
    const std::size_t first = map_.surfels.size();
    test::add_floor(map_, {0, -1}, {1, 1}, [](double, double) { return 0.12; });
    for (std::size_t k = first; k < map_.surfels.size(); ++k) map_.surfels[k].parent_plane = 7;
  }
  // On or over the cells from x to x + 0.4.
  void meet(double x, double z) {
    for (int i = 0; i < 8; ++i) {
      for (int j = -4; j < 4; ++j) {
        map_.loose_points.emplace_back(x + 0.05 * i + 0.025, 0.05 * j + 0.025, z);
      }
    }
  }
  PlanarMap map_;
};

TEST_F(RasterPlatform, WhatWasMetAtItsHeightIsItsTopNoObstacle) {
  meet(1.0, 0.127);
  const NavigabilityGrid grid = rasterize(map_);
  for (const double x : {1.125, 1.225, 1.325}) {
    const NavigabilityCell cell = test::at(grid, x, 0.025);
    EXPECT_NEAR(cell.height, 0.12F, 1e-3F) << x;
    EXPECT_FALSE(cell.known()) << x;
  }
  EXPECT_NEAR(test::at(grid, 0.525, 0.025).navigability, 1 - 0.12F / 0.75F, 0.01F);
}

TEST_F(RasterPlatform, WhatStandsOnItBlocks) {
  meet(1.0, 0.15);
  const NavigabilityGrid grid = rasterize(map_);
  EXPECT_EQ(test::at(grid, 1.225, 0.025).navigability, 0.0F);
}

// Points of its top above the floor that is seen under it block the floor.
TEST_F(RasterPlatform, ItsTopBlocksTheFloorUnderIt) {
  test::add_floor(map_, {1, -1}, {2, 1}, [](double, double) { return 0.0; });
  test::add_path(map_, {1.5, -0.9, 0}, {1.5, 0.9, 0});
  meet(1.2, 0.12);
  const NavigabilityGrid grid = rasterize(map_);
  EXPECT_EQ(test::at(grid, 1.325, 0.025).navigability, 0.0F);
  EXPECT_EQ(test::at(grid, 1.825, 0.025).navigability, 1.0F);
}

TEST(Rasterizer, TellsWhatIsSolidOverItsFloor) {
  PlanarMap map;
  test::add_floor(map, {0, -1}, {2, 1}, [](double, double) { return 0.1; });
  test::add_path(map, {0.5, -0.9, 0.1}, {0.5, 0.9, 0.1});
  map.loose_points = {{1.01, 0.01, 0.8}, {1.02, 0.02, 0.7}, {1.51, 0.01, 0.95}, {1.52, 0.01, 0.95}};
  Rasterizer rasterizer;
  rasterizer.update(map);
  const std::vector<SolidCell> solid = rasterizer.solid_cells();
  ASSERT_EQ(solid.size(), 1u);  // the others hang above the robot
  EXPECT_EQ(solid[0].cell, (CellIndex{20, 0}));
  EXPECT_NEAR(solid[0].floor, 0.1, 1e-6);
  EXPECT_NEAR(solid[0].low, 0.7, 1e-6);
  EXPECT_NEAR(solid[0].high, 0.8, 1e-6);
}

}  // namespace
}  // namespace lamina
