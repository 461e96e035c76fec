// Stretches of walls' lines, in plan, and whether keyframes looked through them.
#pragma once

#include <Eigen/Core>
#include <map>
#include <span>
#include <vector>

#include <lamina/backend/association/outlines.hpp>
#include <lamina/backend/graph/graph.hpp>

namespace lamina {

/// Planes of which |n.z| is at most this count as walls (17 degrees).
constexpr double kUprightNormal = 0.3;

/// From a to b, map frame, in plan (m): nothing of a wall was seen between them.
struct SightGap {
  SightGap(const Eigen::Vector2d& from, const Eigen::Vector2d& to);
  /// Share of its decimetres through which two lines of sight went, or the robot itself.
  double open() const;

  Eigen::Vector2d a, b;
  std::vector<int> lines;  ///< through each decimetre
};

/// Counts lines of sight through the gaps: from every keyframe's body to what it saw of upright
/// planes, less 0.3 m, and along the path where keyframes follow each other closely. `outlines`:
/// what keyframes saw of each plane.
void look_through(const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
                  std::span<SightGap> gaps);

}  // namespace lamina
