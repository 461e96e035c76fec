// Sets of cells of one tile: internal to the rasterizer.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

namespace lamina::raster {

constexpr int kSide = 32;  ///< cells of a tile; small, so that one frame touches little
constexpr int kCells = kSide * kSide;

/// A bit for each cell, cell (i, j) in row j.
struct CellMask {
  std::array<std::uint32_t, kSide> rows{};

  void set(int cell) {
    rows[static_cast<std::size_t>(cell / kSide)] |= 1U << static_cast<unsigned>(cell % kSide);
  }
  bool any() const {
    return std::any_of(rows.begin(), rows.end(), [](std::uint32_t row) { return row != 0; });
  }
  CellMask& operator|=(const CellMask& other) {
    for (std::size_t j = 0; j < rows.size(); ++j) rows[j] |= other.rows[j];
    return *this;
  }
  /// visit(i, j), row by row.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (int j = 0; j < kSide; ++j) {
      for (std::uint32_t row = rows[static_cast<std::size_t>(j)]; row != 0; row &= row - 1) {
        visit(std::countr_zero(row), j);
      }
    }
  }
};

/// The cells within `margin` (at most 16) of those set, diagonally too: in the eight tiles around
/// and, in the middle, the tile itself, row by row from the lower left.
std::array<CellMask, 9> grown(const CellMask& cells, int margin);

}  // namespace lamina::raster
