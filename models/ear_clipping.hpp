// A simple polygon cut into triangles.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

namespace lamina {

/// Ear clipping [Meisters1975] of an outline (m, either way round, first vertex not repeated):
/// indices into it, each triangle counter-clockwise, together the outline's area. Triangles without
/// area are left out. Where an outline crosses or touches itself the ear that covers least counts,
/// so that an end is always found; fewer than three vertices, or any not finite: none.
std::vector<std::array<std::size_t, 3>> triangles_of(const std::vector<Eigen::Vector2d>& outline);

}  // namespace lamina
