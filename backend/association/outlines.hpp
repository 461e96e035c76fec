// Outlines of planes: grown from what was seen of them, concave where the evidence is.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

/// What one keyframe saw of a plane: a closed outline (three points or more) or a stroke (two).
struct OutlinePiece {
  KeyframeId keyframe = KeyframeId::kNone;
  std::vector<Eigen::Vector3d> points_body;
};

/// Marks the cells of the plane's outline that the piece covers: projected along the normal.
/// Points that are not finite make it do nothing.
void grow_outline(PlaneLandmark& plane, std::span<const Eigen::Vector3d> points_map);

/// Empties the outline and grows it from all pieces, by the keyframes' present poses. The outline's
/// frame is made anew too: the plane may have moved a lot. Pieces whose keyframe is gone are left
/// out.
void remake_outline(PlaneLandmark& plane, std::span<const OutlinePiece> pieces, const Graph& graph,
                    double cell_size);

/// Closed outlines in the map frame, on the plane, largest first.
std::vector<std::vector<Eigen::Vector3d>> outlines_map(const PlaneLandmark& plane);

/// One closed ring round all that was seen, in the map frame, on the plane: parts are joined, each
/// to the nearest, by strips a cell wide. Empty while nothing was seen.
std::vector<Eigen::Vector3d> ring_map(const PlaneLandmark& plane);

/// Middle of what was seen, on the plane; the anchor while nothing was.
Eigen::Vector3d outline_centroid_map(const PlaneLandmark& plane);

}  // namespace lamina
