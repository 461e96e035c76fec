// Planes in a row whose names have slipped by one: a slab taken for the wall behind it.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include <lamina/backend/association/outlines.hpp>
#include <lamina/backend/consistency/merge_candidates.hpp>
#include <lamina/backend/refine/refiner.hpp>

namespace lamina {

/// Three planes of one side in a row, `beside` and `into` as far apart as `into` and `from`: some
/// keyframes see the one pair, others the other. Either there are three, or the names of the latter
/// keyframes have slipped by one, on a path that had drifted by the distance: what they call `from`
/// is `into`, and what they call `into` (`views`) is `beside`. The second needs a plane less and no
/// coincidence.
struct ShiftedAssociations {
  PlaneId from = PlaneId::kNone, into = PlaneId::kNone, beside = PlaneId::kNone;
  std::size_t missed = 0;  ///< keyframes that see two of them, and not the third in their place
  std::vector<std::size_t> views;  ///< indices into Graph::plane_moments
};

/// Rows of planes, each with either end as `from`; where some views of `into` see neither, also
/// with those given to the nearer group (by keyframes). Planes are told apart by keyframes that see
/// both (no pose stands between two views of one moment), rejected views included: the middle one's
/// distances to either side agree within `options.gate` of their variance, no further than one wall
/// may stand apart; most of those views lie over each other. Deterministic.
std::vector<ShiftedAssociations> find_shifted_associations(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    const DoubleOptions& options);

/// Tries each row (eight at most) by itself: with the names put right the views concerned are
/// believed far beyond their covariance while the others are judged against them, then all are
/// judged as ever. The best stands when most of the renamed views are believed and the truncated
/// cost rises by less than
///   gate + 2 missed ln(1/0.5),
/// what the plane less may cost, and twice the log likelihood of three planes of which every image
/// happens to show two: half of the images that show where a plane is miss it, at most.
///
/// Returns it; `graph` then has the states and weights of that solution and the new names of
/// `views`; merging `from` into `into` is the caller's. Otherwise the graph is as it was.
/// `refined`: what refine() returned for `graph`.
std::optional<ShiftedAssociations> test_shifted_associations(
    Graph& graph, const std::vector<ShiftedAssociations>& rows, double gate,
    const RefineResult& refined, const RefineOptions& options,
    const std::function<bool(const RefineProgress&)>& progress);

}  // namespace lamina
