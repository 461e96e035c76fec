// Layers as images.
#include <lamina/grid/navigability_grid.hpp>

#include <algorithm>

namespace lamina {

void layer_row(const NavigabilityGrid& grid, const GridGeometry& geometry, int row,
               float NavigabilityCell::*layer, float* out) {
  std::fill_n(out, geometry.width, NavigabilityCell::kUnknown);
  const std::int32_t j = geometry.first.j + geometry.height - 1 - row;
  grid.for_each_in_row(j, [&](const CellIndex& first, const NavigabilityCell* cells) {
    const std::int32_t from = std::max(0, geometry.first.i - first.i);
    const std::int32_t to =
        std::min(NavigabilityGrid::kTile, geometry.first.i + geometry.width - first.i);
    for (std::int32_t k = from; k < to; ++k) out[first.i + k - geometry.first.i] = cells[k].*layer;
  });
}

}  // namespace lamina
