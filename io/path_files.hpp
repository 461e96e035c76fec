// path.csv and path.png: a planned path, to follow and to look at.
#pragma once

#include <filesystem>
#include <vector>

#include <lamina/grid/navigability_grid.hpp>

namespace lamina::io {

/// Lines `x,y` under a header line, map frame, metres, to a tenth of a millimetre.
void write_path_csv(const std::filesystem::path& file,
                    const std::vector<Eigen::Vector2d>& path_map);

/// Back again; throws lamina::Error naming file and line.
std::vector<Eigen::Vector2d> read_path_csv(const std::filesystem::path& file);

/// The grid from above, x to the right and y up, at least 400 pixels wide or high where that takes
/// at most 16 pixels a cell: black blocked to white level floor, grey-blue unknown; the path in
/// red, its start green, its goal blue. A path of two points that are no path (start and goal of a
/// plan that failed) may be given with `line` false: only the ends are drawn.
void write_path_png(const std::filesystem::path& file, const NavigabilityGrid& grid,
                    const std::vector<Eigen::Vector2d>& path_map, bool line = true);

}  // namespace lamina::io
