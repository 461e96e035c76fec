// Tracks as planes of their own: what they tell where the names of planes are mostly wrong.
#pragma once

#include <cstddef>
#include <cstdint>

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/refine/consensus.hpp>
#include <lamina/backend/refine/refiner.hpp>

namespace lamina {

/// The path that odometry and the tracks themselves tell: every track a plane of its own, whatever
/// its views are named. No name is believed, no place met again: drift remains, but what is left of
/// it is far less than odometry's, and wrong names stand out against it. Moves keyframes and
/// extrinsics, nothing else.
void follow_tracks(Graph& graph, const Tracks& tracks, const RefineOptions& options);

/// Factors and planes that a graph has for one solve alone. Rejected views of a track are heard
/// under the name of the track (names_of_tracks()), and where it has none as views of one nameless
/// plane. The names they carry stay rejected.
class TrackViews {
 public:
  /// Remembers what the graph has now.
  explicit TrackViews(const Graph& graph)
      : factors_(graph.plane_moments.size()),
        planes_(graph.planes.size()),
        next_plane_(graph.next_plane) {}
  /// `limit`: chi-squared beyond which a view does not fit a name. False: nothing was added.
  bool add(Graph& graph, const Tracks& tracks, double limit) const;
  void remove(Graph& graph) const;

 private:
  std::size_t factors_, planes_;
  std::int64_t next_plane_;
};

}  // namespace lamina
