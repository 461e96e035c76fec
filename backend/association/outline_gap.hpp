// May two pieces of a surface be one, as far as what lies between them goes?
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

/// Whether what lies between two sets of points (one frame, m) is no wider than either reaches that
/// way, nor than `most`: a door interrupts a wall, two desks in a row are two. Half a metre lies
/// between pieces of any size. Where either lies level (a stroke of a scan; map axes), the gap is
/// that in plan; where one alone does, no wider than what both reach in the mean: what hides a wall
/// from a scanner leaves short pieces of it. False where either is empty.
bool beside(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b, double most);

/// Middles of the cells in which a plane was seen, in the map frame, on the plane.
std::vector<Eigen::Vector3d> seen_points_map(const PlaneLandmark& plane);

/// Whether any of the points (map frame) falls, along the normal, on a cell in which the plane was
/// seen.
bool falls_on(const PlaneLandmark& plane, std::span<const Eigen::Vector3d> points_map);

}  // namespace lamina
