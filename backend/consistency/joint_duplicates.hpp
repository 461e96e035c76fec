// Doubles that are known too little to each other one by one, and tell each other.
#pragma once

#include <map>
#include <set>
#include <utility>
#include <vector>

#include <lamina/backend/association/outlines.hpp>
#include <lamina/backend/consistency/merge_candidates.hpp>

namespace lamina {

/// Pairs (from, into) as find_doubles() has them, but for DoubleOptions::max_sigma_m: where a lap
/// ends at its beginning, no single wall that agrees means anything. Two do that face different
/// ways: with p taken for one surface, d_p = 0,
///   d_q|p = d_q - C_qp C_pp^-1 d_p,   C_q|p = C_qq - C_qp C_pp^-1 C_pq,
/// (d, C: PlaneGap and its covariance, surfaces' noise added), and q that is known to `max_sigma_m`
/// then, and within the gate still, would be so by chance where the two sides of a corridor were
/// both another's that is as wide. p and q are of four planes, their normals 60 degrees apart at
/// least. A plane that another choice has told so, too, waits. One pair a plane at most.
/// Deterministic.
std::vector<std::pair<PlaneId, PlaneId>> find_joint_duplicates(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    const std::set<std::pair<PlaneId, PlaneId>>& apart, const DoubleOptions& options);

}  // namespace lamina
