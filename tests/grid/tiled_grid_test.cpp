// Cells in tiles.
#include <gtest/gtest.h>

#include <lamina/grid/tiled_grid.hpp>

namespace lamina {
namespace {

TEST(TiledGrid, KeepsCellsOnBothSidesOfZeroApart) {
  TiledGrid<int> grid(0.1);
  for (int i = -130; i <= 130; i += 13) {
    for (int j = -130; j <= 130; j += 13) grid.at_or_new({i, j}) = 1000 * i + j;
  }
  for (int i = -130; i <= 130; i += 13) {
    for (int j = -130; j <= 130; j += 13) {
      ASSERT_NE(grid.find({i, j}), nullptr);
      EXPECT_EQ(*grid.find({i, j}), 1000 * i + j);
    }
  }
  EXPECT_EQ(grid.find({1000, 1000}), nullptr);
}

TEST(TiledGrid, MemoryFollowsWhatIsKnown) {
  TiledGrid<int> grid;
  grid.at_or_new({0, 0}) = 1;
  grid.at_or_new({100000, -100000}) = 1;
  EXPECT_EQ(grid.tile_count(), 2u);
}

TEST(TiledGrid, BoundsAreTheKnownCells) {
  TiledGrid<int> grid(0.05);
  EXPECT_TRUE(grid.bounds([](int v) { return v != 0; }).empty());
  grid.at_or_new({-3, 7}) = 1;
  grid.at_or_new({5, -2}) = 1;
  const GridGeometry g = grid.bounds([](int v) { return v != 0; });
  EXPECT_EQ(g.first, (CellIndex{-3, -2}));
  EXPECT_EQ(g.width, 9);
  EXPECT_EQ(g.height, 10);
  EXPECT_EQ(g.image_index({-3, 7}), 0u);
}

TEST(GridGeometry, CellsAreHalfOpenSquares) {
  EXPECT_EQ(cell_of({0.0, -0.0001}, 0.05), (CellIndex{0, -1}));
  EXPECT_EQ(cell_of({0.0499, 0.05}, 0.05), (CellIndex{0, 1}));
  EXPECT_NEAR(center_of({-1, 0}, 0.05).x(), -0.025, 1e-15);
}

}  // namespace
}  // namespace lamina
