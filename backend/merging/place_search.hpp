// Where the walls of one map lie among those of another, in plan, and how sure that is.
#pragma once

#include <vector>

#include <lamina/backend/merging/wall_map.hpp>

namespace lamina {

/// What a place has for and against it: the logarithm of how much likelier the walls are as seen
/// if the maps lie so than if they have nothing to do with each other. A fact is a line of walls of
/// one map where the other has looked; there it is
///   seen:      log(q / p)              p: share of the places beside it (up to 4 m along its
///   not seen:  log((1 - q) / (1 - p))  normal) where it would count as seen, too
/// with q = 0.75. Both maps' lines count half, as most are of both. A stretch of wall of 0.5 m and
/// more through which rays of the other map went takes 4 a metre: chairs move, walls do not.
struct PlaceEvidence {
  double nats = 0;
  double same = 0, other = 0;        ///< lines of walls, halves of both maps
  double same_m = 0, through_m = 0;  ///< metres of wall
};

struct PlanPlace {
  PlanPose T_a_b;
  PlaceEvidence evidence;
  bool determined = false;  ///< walls fix x, y and heading
};

struct PlaceSearchResult {
  std::vector<PlanPlace> places;  ///< the most likely first, no two of them alike
  double log_places = 0;          ///< logarithm of the number of places that were looked at
};

/// All shifts on a grid of 0.2 m (coarser for large maps) under every turn that pairs of walls
/// propose, the best of them solved. Deterministic.
PlaceSearchResult search_places(const PlanWalls& a, const PlanWalls& b);

/// What one place has for and against it.
PlaceEvidence weigh_place(const PlanWalls& a, const PlanWalls& b, const PlanPose& T_a_b);

/// Logarithm of how much less likely this stretch of wall (m) is where rays went through it.
inline constexpr double kThroughPerMetre = 4;

}  // namespace lamina
