// Planes of a refined map that are one: agreement where they meet, by what both are known together.
#pragma once

#include <map>
#include <set>
#include <utility>
#include <vector>

#include <lamina/backend/association/association.hpp>
#include <lamina/backend/association/outlines.hpp>
#include <lamina/backend/graph/graph.hpp>

namespace lamina {

struct DoubleOptions {
  AssociationOptions association;  ///< surface noise, gap, and how far apart one wall may stand
  /// Bound on the chi-squared of (tilt, tilt, distance) between the two, 99 % of 3 degrees.
  double gate = 11.3;
  /// Pairs known less well to each other than this (1-sigma of the distance where they meet, m)
  /// wait: agreement would mean nothing. Other merges tie the places together first.
  double max_sigma_m = 0.06;
  /// rad, 1-sigma: by how much views of floors that are no planes are turned; others: absent.
  std::map<PlaneId, double> ground_tilt;
};

/// Pairs (from, into) of active planes, at least one of them seen as an area, that are one surface,
/// the one with fewer views first. Seen from the same side, outlines at most the association's gap
/// apart and no further than either is wide that way (a door interrupts a wall, two desks are two),
/// and
///   d^T (J C J^T + S)^-1 d <= gate,   d = a [-] b about the middle of a's evidence,
/// C the joint 6x6 covariance of both planes in the whole graph: drift between two visits widens
/// it, views from one keyframe leave no room for a slab on a floor. S: surfaces are not planes.
/// Level planes with an edge or a lower one seen between them (LevelGaps) are two, however level
/// with each other: two platforms, two desks in a row. A
/// set of planes becomes one only when all its near pairs agree; one that fits two planes alike
/// which do not fit each other waits. Pairs in `apart` are never proposed. Deterministic.
std::vector<std::pair<PlaneId, PlaneId>> find_doubles(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    const std::set<std::pair<PlaneId, PlaneId>>& apart, const DoubleOptions& options);

/// The same for planes that scans alone have seen, lines in one level: nothing of a scan tells a
/// piece of wall from the next, and a robot's drift along a wall shows in it. Each joins the best
/// plane up to half a gap away within 99 % of both their own covariances, poses being wrong by 6 mm
/// and 0.15 degrees among each other; a few views join a large plane within 3 cm of them, and what
/// goes through another plane joins that (crossing_planes.hpp).
std::vector<std::pair<PlaneId, PlaneId>> find_line_doubles(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    double prior_tilt, const DoubleOptions& options);

/// Pairs (from, into): the few views of `from` (up to six, or 2 % of the other's) lie within 3 cm
/// of `into` all over, where that was seen too. Clutter of a large plane's own noise: a bend of the
/// image, a grazing view. Of a floor that is no plane: turned by no more than two sigmas of its
/// views. Not where keyframes saw an edge between the two (LevelGaps::step).
std::vector<std::pair<PlaneId, PlaneId>> find_slivers(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    const std::set<std::pair<PlaneId, PlaneId>>& apart, const DoubleOptions& options);

/// Pairs (from, into) that cannot both be there, the one with fewer views first: seen from the same
/// side, no further apart nor more turned than one wall may be, most of the smaller one's outline
/// within the other's, so that one would be seen through the other. Areas of some width only. No
/// keyframe's views of the two tell them apart nor show an edge (LevelGaps::step), and neither of
/// them stands nearer to a plane that it is told apart from. Pairs in `apart` are never proposed.
std::vector<std::pair<PlaneId, PlaneId>> find_seen_through(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    const std::set<std::pair<PlaneId, PlaneId>>& apart, const DoubleOptions& options);

}  // namespace lamina
