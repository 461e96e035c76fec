// terrain.ply: the ground as a coloured mesh, for mesh viewers.
#pragma once

#include <filesystem>

#include <lamina/grid/navigability_grid.hpp>

namespace lamina::io {

/// A vertex at the centre of each cell with a height, two triangles between each four of them;
/// green where navigability is 1 over yellow to red where it is 0, grey where it is unknown.
/// Binary little-endian PLY, map frame, metres.
void write_terrain_ply(const std::filesystem::path& file, const NavigabilityGrid& grid);

}  // namespace lamina::io
