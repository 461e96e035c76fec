// How far each cell is from the nearest one a robot must not touch.
#pragma once

#include <vector>

#include <lamina/grid/navigability_grid.hpp>

namespace lamina {

/// Euclidean distances between centres of cells, in metres, over `geometry` (index by
/// GridGeometry::image_index), from each cell to the nearest one that is not navigable: blocked,
/// unknown, or outside the grid. Exact, linear in the cells [Felzenszwalb2012].
std::vector<float> clearance_image(const NavigabilityGrid& grid, const GridGeometry& geometry);

}  // namespace lamina
