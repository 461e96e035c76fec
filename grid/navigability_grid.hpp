// Where a robot may go: layers over one geometry.
#pragma once

#include <limits>

#include <lamina/grid/tiled_grid.hpp>

namespace lamina {

/// NaN in every layer: unknown.
struct NavigabilityCell {
  static constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  float height = kUnknown;        ///< m, map z: the highest surface a robot would touch
  float slope = kUnknown;         ///< rad, of the surface
  float navigability = kUnknown;  ///< 0: never, 1: level floor
  float confidence = kUnknown;    ///< 0..1: probability that the verdict is right

  bool known() const { return navigability == navigability; }
};

using NavigabilityGrid = TiledGrid<NavigabilityCell>;

inline GridGeometry known_bounds(const NavigabilityGrid& grid) {
  return grid.bounds([](const NavigabilityCell& c) { return c.known() || c.height == c.height; });
}

/// One row of a layer as an image over `geometry`, `width` values: row 0 at the largest y, NaN
/// where nothing is known. Images of wide maps are never held whole.
void layer_row(const NavigabilityGrid& grid, const GridGeometry& geometry, int row,
               float NavigabilityCell::*layer, float* out);

}  // namespace lamina
