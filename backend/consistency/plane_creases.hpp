// Planes that a few views made of the crease between others.
#pragma once

#include <map>
#include <set>
#include <vector>

#include <lamina/backend/association/outlines.hpp>

namespace lamina {

/// Slanting planes (10 to 73 degrees from level) that no more than six keyframes saw, of which nine
/// tenths lie within 5 cm of other planes that are turned against them by 10 degrees at least and
/// were seen there by twice as many keyframes: the foot of a wall, blurred by the blocks of an
/// image, passes for a small ramp now and then. `outlines`: what keyframes saw of each plane. Of
/// planes that scans alone have seen none is named.
std::set<PlaneId> creases(const Graph& graph,
                          const std::map<PlaneId, std::vector<OutlinePiece>>& outlines);

}  // namespace lamina
