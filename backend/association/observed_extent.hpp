// From which keyframes a plane was seen at a place of it.
#pragma once

#include <cstddef>
#include <set>
#include <utility>
#include <vector>

#include <lamina/backend/association/outlines.hpp>
#include <lamina/models/polygon.hpp>

namespace lamina {

/// Those of the pieces that are still in the graph.
std::set<KeyframeId> keyframes_of(const Graph& graph, const std::vector<OutlinePiece>& pieces);

/// Points of the map, `spacing` m apart, all over what keyframes saw of a plane; strokes of scans
/// have none.
std::vector<Eigen::Vector3d> seen_points(const Graph& graph,
                                         const std::vector<OutlinePiece>& pieces, double spacing);

/// What keyframes saw of a plane, laid in it.
class SeenPlane {
 public:
  SeenPlane(const Graph& graph, const PlaneLandmark& plane,
            const std::vector<OutlinePiece>& pieces);
  /// Whether at least `n` keyframes saw the plane at the foot of a point, or no further than
  /// `beside` (m) from it.
  bool seen(const Eigen::Vector3d& p_map, std::size_t n, double beside) const;

 private:
  SE3 T_outline_map_;
  std::vector<std::pair<KeyframeId, Polygon>> outlines_;
};

}  // namespace lamina
