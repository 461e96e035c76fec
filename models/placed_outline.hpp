// Outlines of a seen area where it lies in space.
#pragma once

#include <vector>

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/outline_grid.hpp>

namespace lamina {

/// Closed outlines of the cells, largest first; the grid lies in x-y of `T_map_outline`.
std::vector<std::vector<Eigen::Vector3d>> outlines_in(const OutlineGrid& outline,
                                                      const SE3& T_map_outline);

/// One closed ring round all cells: parts are joined, each to the nearest, by strips a cell wide.
/// Empty for an empty grid.
std::vector<Eigen::Vector3d> ring_in(const OutlineGrid& outline, const SE3& T_map_outline);

}  // namespace lamina
