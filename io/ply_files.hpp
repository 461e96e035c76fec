// planes.ply and surfels.ply: for mesh and cloud viewers.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include <lamina/models/planar_map.hpp>

namespace lamina::io {

/// Red, green, blue of planes with a label.
std::array<std::uint8_t, 3> color_of(PlaneLabel label);

/// Outlines as triangles (`list uchar int vertex_indices`, then `int plane_id`), vertices with the
/// plane's normal, towards the side it was seen from, and coloured by label; binary little-endian.
void write_planes_ply(const std::filesystem::path& file, const std::vector<MapPlane>& planes);
/// Discs as x y z nx ny nz radius sigma_height (float); binary little-endian PLY.
void write_surfels_ply(const std::filesystem::path& file, const std::vector<Surfel>& surfels);

}  // namespace lamina::io
