// Pieces of one wall with something before what lies between them.
#pragma once

#include <map>
#include <set>
#include <utility>
#include <vector>

#include <lamina/backend/association/outlines.hpp>
#include <lamina/backend/consistency/merge_candidates.hpp>

namespace lamina {

/// Pairs (from, into) as find_doubles() has them, of walls, one of them seen by images, further
/// apart in plan than its gap, up to 2.5 m, and at one height: a shelf, and a partition behind it,
/// hide a wall. Through what lies between, in plan, nobody looked nor drove (SightGap): what is
/// open there is not one wall. Best first, one pair a plane at most, no pair in `apart`.
/// Deterministic.
std::vector<std::pair<PlaneId, PlaneId>> find_occluded_duplicates(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    const std::set<std::pair<PlaneId, PlaneId>>& apart, const DoubleOptions& options);

}  // namespace lamina
