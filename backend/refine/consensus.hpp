// Which observations of one plane agree with each other, by odometry alone.
#pragma once

#include <cstddef>
#include <vector>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

struct Agreement {
  /// For every plane_moments factor 1: it agrees with a neighbour in time, or is the first of a
  /// plane where none do; 0: it stands alone, to be judged by a solution made without it.
  std::vector<double> weights;
  /// Whether the factor belongs to the largest group of its plane (the earliest of equals).
  std::vector<bool> in_largest;
  std::size_t conflicts = 0;  ///< how many could be compared with a neighbour and agreed with none
};

/// Two observations of one plane agree when one plane fits both: the least eigenvalue of their
/// merged scatter, a chi-squared, is at most `inlier_chi2` once the later has been discounted by
/// what odometry may have drifted between them. Keyframes further apart than odometry can tell are
/// not compared: a second visit forms its own group. Reads poses, not planes' estimates.
Agreement agreeing_observations(const Graph& graph, double inlier_chi2);

/// Full views that are one surface by geometry and odometry alone, whatever plane they name.
struct Tracks {
  static constexpr int kNone = -1;
  std::vector<int> track;  ///< of every plane_moments factor; kNone: seen once, or partially
  int count = 0;
};

/// Joins full views of neighbouring keyframes that one plane fits, from the same side, by the rule
/// of agreeing_observations(). A sensor that moves on sees each surface several times in a row: the
/// tracks hold together where names are mostly wrong.
Tracks geometric_tracks(const Graph& graph, double inlier_chi2);

/// Agreement of names within tracks: a view counts (weight 1) when its plane is named at least
/// twice in its track and two thirds as often as the name heard most. Views outside tracks weigh 0,
/// partial views 1. in_largest: of the track that gives its plane the most views.
Agreement agreement_of(const Graph& graph, const Tracks& tracks);

/// Of the names that a track's views carry, the one under which all its views together fit best,
/// each counted to `limit` at most; kNone where not half of them fit at all.
std::vector<PlaneId> names_of_tracks(const Graph& graph, const Tracks& tracks, double limit);

}  // namespace lamina
