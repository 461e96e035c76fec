// Where one plane is several walls: coplanar pieces with a wide opening between them.
#pragma once

#include <map>
#include <vector>

#include <lamina/backend/association/outlines.hpp>

namespace lamina {

/// Upright planes (within 17 degrees) whose outline falls into pieces more than `max_gap_m` apart,
/// in plan, with an opening between: keyframes looked, or drove, through half of what lies between
/// at least. The outline of each wall, along the plane. Planes that are one wall are not in the
/// result: nor are those behind whose gap nobody saw anything, which may be one wall behind a
/// cupboard. `outlines`: what keyframes saw of each plane; sight lines are drawn, in plan, from
/// bodies to what they saw of upright planes, less 0.3 m.
std::map<PlaneId, std::vector<OutlineGrid>> walls_apart(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    double max_gap_m);

}  // namespace lamina
