// A scan segment against a plane, in the document's terms.
//
//   r = S (n_body . u, n_body . m + n.(t - anchor) - rho)
// u: unit direction of the segment, m: its middle, both in the body frame. The first entry is the
// sine of the rotation between the segment and its projection onto the plane (to third order the
// angle, and smooth everywhere), the second the mean distance of its end points. S whitens by the
// covariance of the fit: segment_sqrt_information().
//
// The cost is quadratic in (n_body, distance), so moments say it exactly: with S^T S = (a b; b c),
//   |r|^2 = c (d(m) + (b/c) n_body.u)^2 + (a - b^2/c) (n_body.u)^2,
// which is the residual of plane_moments.hpp with weight c, mean m + (b/c) u and one row
// sqrt(a - b^2/c) u: moments_of(). Segments of one keyframe on one plane add up by merging them.
//
// With T exp(d): d(n_body.u)/dT = (0, u x n_body), distance as in plane_moments.hpp.
#pragma once

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/graph/states.hpp>

namespace lamina {

struct SegmentTerm {
  static constexpr int kResiduals = 2;
  using Jacobians = TermJacobians<2, PoseState, PlaneState>;
  Eigen::Vector3d direction_body = Eigen::Vector3d::UnitX();
  Eigen::Vector3d middle_body = Eigen::Vector3d::Zero();
  Eigen::Matrix2d sqrt_information;
  Eigen::Vector3d anchor_map;

  SegmentTerm() = default;
  /// A segment of no length keeps its distance and gives no rotation.
  SegmentTerm(const SegmentFactor& f, const Eigen::Vector3d& anchor);

  void evaluate(const PoseState& pose, const PlaneState& plane, Eigen::Vector2d& residual,
                Jacobians* J) const;
};

/// The moments of weight, mean and scatter that cost as much as the segment against every plane
/// and pose, to the last digits (not discounted()). `count` is theirs. Without information about
/// the distance: empty.
Moments moments_of(const SegmentFactor& f, std::int64_t count);

/// Of (rotation, mean distance) from the fit's covariance of (rho, theta) and what its points
/// share. rho varies along the line, so it is carried to the middle of the end points:
/// sigma^2(mid) = a C a^T, a = (-1, s), s the middle's coordinate along the line. Start and end may
/// stand in either order; the plane's normal is taken to point towards the scanner.
Eigen::Matrix2d segment_sqrt_information(const ScanSegment& segment, const NoiseFloor& floor);

}  // namespace lamina
