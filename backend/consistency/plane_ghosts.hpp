// Planes that a few views laid through what others saw well.
#pragma once

#include <map>
#include <set>
#include <vector>

#include <lamina/backend/association/outlines.hpp>

namespace lamina {

/// Upright planes that no more than six keyframes saw, and that go through another upright plane of
/// ten times as many observations: half or more of them lies over what was seen of it, a fifth of
/// that over 7 cm behind it, a fifth before it, and they are turned against each other by 10 to 45
/// degrees. Surfaces are opaque: from afar the squares of an image take in the end of a shelf and
/// the wall behind it as one. (Walls that end at another one a little late are turned by more.)
/// `outlines`: what keyframes saw of each plane. Of planes that scans alone have seen none is
/// named.
std::set<PlaneId> ghosts(const Graph& graph,
                         const std::map<PlaneId, std::vector<OutlinePiece>>& outlines);

}  // namespace lamina
