// Layers as images.
#include <lamina/grid/navigability_grid.hpp>

namespace lamina {

std::vector<float> layer_image(const NavigabilityGrid& grid, const GridGeometry& geometry,
                               float NavigabilityCell::*layer) {
  std::vector<float> image(
      static_cast<std::size_t>(geometry.width) * static_cast<std::size_t>(geometry.height),
      NavigabilityCell::kUnknown);
  grid.for_each([&](const CellIndex& c, const NavigabilityCell& cell) {
    if (geometry.contains(c)) image[geometry.image_index(c)] = cell.*layer;
  });
  return image;
}

}  // namespace lamina
