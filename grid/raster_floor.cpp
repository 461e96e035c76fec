// Sizes and heights of surfaces.
#include <lamina/grid/raster_floor.hpp>

#include <algorithm>

namespace lamina::raster {

std::vector<FloorPiece> floor_pieces(const std::vector<Tile*>& tiles, Components& all,
                                     std::size_t count) {
  std::vector<FloorPiece> pieces(count);
  for (const Tile* tile : tiles) {
    for (const Level& level : tile->levels) {
      const auto root = all.root(tile->first_component + level.component);
      FloorPiece& piece = pieces[static_cast<std::size_t>(root)];
      ++piece.cells;
      piece.height_sum += static_cast<double>(level.surface.height);
    }
  }
  return pieces;
}

std::size_t largest(const std::vector<FloorPiece>& pieces) {
  const auto most =
      std::max_element(pieces.begin(), pieces.end(),
                       [](const FloorPiece& a, const FloorPiece& b) { return a.cells < b.cells; });
  return static_cast<std::size_t>(most - pieces.begin());
}

bool carried_over(const std::vector<FloorPiece>& pieces, const std::vector<char>& reached,
                  std::size_t floor) {
  constexpr std::int64_t kMuchLarger = 4;
  if (reached[floor] != 0) return false;
  std::int64_t under_path = 0;
  for (std::size_t k = 0; k < reached.size(); ++k) {
    if (reached[k] == 0) continue;
    if (!(pieces[k].height() > pieces[floor].height())) return false;
    under_path += pieces[k].cells;
  }
  return pieces[floor].cells > kMuchLarger * under_path;
}

}  // namespace lamina::raster
