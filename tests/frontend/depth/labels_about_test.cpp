// Labels about a block, eight bytes at once, are those that a plain loop finds.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include <lamina/frontend/depth/labels_about.hpp>

namespace lamina {
namespace {

LabelsAbout::Found plain(const std::vector<std::int16_t>& labels, int columns, int rows, int column,
                         int row) {
  LabelsAbout::Found found;
  for (int r = std::max(0, row - 2); r <= std::min(rows - 1, row + 2); ++r) {
    for (int c = std::max(0, column - 2); c <= std::min(columns - 1, column + 2); ++c) {
      const std::int16_t label = labels[static_cast<std::size_t>(r * columns + c)];
      if (label < 0) continue;
      const auto end = found.label.begin() + found.count;
      const auto at = std::find(found.label.begin(), end, label);
      if (at == end && found.count == LabelsAbout::kMost) continue;
      if (at == end) *at = label;
      if (at == end) ++found.count;
      const bool touches = std::abs(r - row) < 2 && std::abs(c - column) < 2;
      found.touching |= static_cast<std::uint8_t>(touches << (at - found.label.begin()));
    }
  }
  return found;
}

// From a few labels to more than six within reach, the largest one, images smaller than a window.
TEST(LabelsAbout, AreThoseOfAPlainLoop) {
  std::mt19937 random(5);
  int full = 0, empty = 0;
  for (const auto& [columns, rows] : {std::pair{23, 9}, {3, 2}, {1, 7}, {1, 1}}) {
    for (const unsigned kinds : {2U, 4U, 9U, 30U}) {
      std::vector<std::int16_t> labels(static_cast<std::size_t>(columns * rows));
      for (auto& label : labels) {
        const unsigned kind = static_cast<unsigned>(random()) % kinds;
        label = static_cast<std::int16_t>(kind == 0 ? -1 : kind == 1 ? 254 : kind * 7);
      }
      LabelsAbout about;
      about.set(labels, columns, rows);
      for (int r = 0; r < rows; ++r) {
        for (int c = 0; c < columns; ++c) {
          const auto found = about.about(c, r), expected = plain(labels, columns, rows, c, r);
          ASSERT_EQ(found.count, expected.count);
          EXPECT_EQ(found.label, expected.label);
          EXPECT_EQ(found.touching, expected.touching);
          full += found.count == LabelsAbout::kMost;
          empty += found.count == 0;
        }
      }
    }
  }
  EXPECT_GT(full, 100);
  EXPECT_GT(empty, 0);
}

}  // namespace
}  // namespace lamina
