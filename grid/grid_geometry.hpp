// Where a grid lies: resolution, lower left corner, size.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <compare>
#include <cstdint>

namespace lamina {

/// Cell (i, j): i along map x, j along map y. Cells are aligned to multiples of the resolution in
/// the map frame, so that grids of one map made at different times lie on each other exactly:
/// cell (i, j) covers [i, i+1) x [j, j+1) times resolution.
struct CellIndex {
  std::int32_t i = 0, j = 0;
  auto operator<=>(const CellIndex&) const = default;
};

inline CellIndex cell_of(const Eigen::Vector2d& xy_map, double resolution) {
  return {static_cast<std::int32_t>(std::floor(xy_map.x() / resolution)),
          static_cast<std::int32_t>(std::floor(xy_map.y() / resolution))};
}
inline Eigen::Vector2d center_of(const CellIndex& cell, double resolution) {
  return {(cell.i + 0.5) * resolution, (cell.j + 0.5) * resolution};
}

/// A rectangle of cells: lower left cell `first`, `width` x `height` cells.
struct GridGeometry {
  double resolution = 0.05;  ///< m
  CellIndex first;
  int width = 0, height = 0;

  bool empty() const { return width <= 0 || height <= 0; }
  bool contains(const CellIndex& c) const {
    return c.i >= first.i && c.j >= first.j && c.i < first.i + width && c.j < first.j + height;
  }
  /// Row-major with row 0 at the *largest* y, as images have it.
  std::size_t image_index(const CellIndex& c) const {
    return static_cast<std::size_t>(height - 1 - (c.j - first.j)) *
               static_cast<std::size_t>(width) +
           static_cast<std::size_t>(c.i - first.i);
  }
  /// Map coordinates of the lower left corner of the lower left cell (m).
  Eigen::Vector2d origin() const { return {first.i * resolution, first.j * resolution}; }
};

}  // namespace lamina
