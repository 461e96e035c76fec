// Which of several level surfaces the grid takes for the floor.
#include <gtest/gtest.h>

#include <lamina/grid/rasterizer.hpp>

#include "terrain.hpp"

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

}  // namespace
}  // namespace lamina
