// Masks of cells grow over the borders of tiles.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <set>
#include <utility>

#include <lamina/grid/raster_mask.hpp>

namespace lamina::raster {
namespace {

TEST(CellMask, VisitsWhatIsSet) {
  CellMask mask;
  EXPECT_FALSE(mask.any());
  const std::set<std::pair<int, int>> cells = {{0, 0}, {31, 0}, {7, 5}, {8, 5}, {0, 31}, {31, 31}};
  for (const auto& [i, j] : cells) mask.set(j * kSide + i);
  std::set<std::pair<int, int>> seen;
  mask.for_each([&](int i, int j) { EXPECT_TRUE(seen.emplace(i, j).second); });
  EXPECT_EQ(seen, cells);
  EXPECT_TRUE(mask.any());
}

TEST(CellMask, GrowsAsCellByCell) {
  std::mt19937 random(3);
  for (const int margin : {0, 1, 2, 9, 16}) {
    for (const int count : {1, 5, 200}) {
      CellMask mask;
      std::set<std::pair<int, int>> expected;  // of the middle tile's cells
      for (int k = 0; k < count; ++k) {
        const int i = static_cast<int>(random() % kSide), j = static_cast<int>(random() % kSide);
        mask.set(j * kSide + i);
        for (int v = j - margin; v <= j + margin; ++v) {
          for (int u = i - margin; u <= i + margin; ++u) expected.emplace(u, v);
        }
      }
      std::set<std::pair<int, int>> seen;
      const auto masks = grown(mask, margin);
      for (int k = 0; k < 9; ++k) {
        masks[static_cast<std::size_t>(k)].for_each(
            [&](int i, int j) { seen.emplace(i + kSide * (k % 3 - 1), j + kSide * (k / 3 - 1)); });
      }
      EXPECT_EQ(seen, expected) << margin << " " << count;
    }
  }
}

}  // namespace
}  // namespace lamina::raster
