// How far two planes of a map are apart where they meet, and how well that is known.
#pragma once

#include <lamina/backend/association/association.hpp>
#include <lamina/backend/graph/graph.hpp>

namespace lamina {

/// d = a [-] b, both about one point of the map: (tilt, tilt, distance) in b's tangent basis.
struct PlaneGap {
  Eigen::Vector3d off = Eigen::Vector3d::Zero();
  /// From the tangents of both planes about their anchors, a's first.
  Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
};

PlaneGap gap_between(const PlaneLandmark& a, const PlaneLandmark& b, const Eigen::Vector3d& middle);

/// The tangent of a plane about its anchor, seen about `middle_map` in the tangent basis `basis`.
Eigen::Matrix3d about_middle(const PlaneLandmark& plane, const Eigen::Vector3d& middle_map,
                             const Matrix32d& basis);

/// What two fits to one surface that is no plane differ by, variances.
Eigen::Vector3d surface_noise(const AssociationOptions& options);

}  // namespace lamina
