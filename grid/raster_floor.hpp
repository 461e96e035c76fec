// Surfaces that are driven on or carried over: which of them is the floor.
#pragma once

#include <cstdint>
#include <vector>

#include <lamina/grid/raster_tile.hpp>

namespace lamina::raster {

/// A surface over all tiles: its levels, joined.
struct FloorPiece {
  std::int64_t cells = 0;
  double height_sum = 0;  ///< m, over the cells
  double height() const { return height_sum / static_cast<double>(cells); }
};

/// By root; `count` components in all, those of `tiles` from first_component on.
std::vector<FloorPiece> floor_pieces(const std::vector<Tile*>& tiles, Components& all,
                                     std::size_t count);

/// The one of most cells. `pieces` must not be empty.
std::size_t largest(const std::vector<FloorPiece>& pieces);

/// Tops of furniture at a carried camera's own height are no floor: whether `floor` lies below all
/// that are `reached` (1, by root) and has more than four times their cells.
bool carried_over(const std::vector<FloorPiece>& pieces, const std::vector<char>& reached,
                  std::size_t floor);

}  // namespace lamina::raster
