// Maps far from their origin.
#include <gtest/gtest.h>

#include <lamina/grid/rasterizer.hpp>

#include "grid/terrain.hpp"

namespace lamina {
namespace {

// Odometry in UTM coordinates: 5,000 km is 1e8 cells.
TEST(Rasterizer, AMapFarFromItsOriginIsDrawnWhole) {
  const double x0 = 4e5, y0 = 5e6;
  PlanarMap map;
  test::add_path(map, {x0 - 1, y0, 0}, {x0 + 1, y0, 0});
  test::add_floor(map, {x0 - 1, y0 - 1}, {x0 + 1, y0 + 1}, [](double, double) { return 0.0; });
  const NavigabilityGrid grid = rasterize(map);
  for (const double y : {-0.775, 0.025, 0.775}) {
    EXPECT_EQ(test::at(grid, x0 + 0.025, y0 + y).navigability, 1.0F) << y;
  }
}

}  // namespace
}  // namespace lamina
