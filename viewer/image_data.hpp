// Grids, occupancy and surfels as JSON text with base64 arrays.
#pragma once

#include <filesystem>
#include <string>

namespace lamina::viewer {

/// {resolution, origin, width, height, step, layers: {NAME: {least, largest, codes}}} of DIR/grid:
/// row 0 at the largest y; `step` is how many cells of the file one cell here stands for. Empty
/// text when the grid has no cells. Codes are base64 of run_lengths().
std::string grid_data(const std::filesystem::path& grid_folder);
/// The same with the one layer `occupancy`, the pixels of occupancy.pgm unchanged: 0 occupied,
/// 205 unknown, 254 free; geometry from occupancy.yaml beside it.
std::string occupancy_data(const std::filesystem::path& pgm_file);
/// {count, total, position, normal, radius} of a binary little-endian PLY of floats.
std::string surfel_data(const std::filesystem::path& ply_file);

}  // namespace lamina::viewer
