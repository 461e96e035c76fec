// A few metres of the way as one map of points, and the test whether two such maps contradict.
#pragma once

#include <cstdint>
#include <vector>

#include <lamina/frontend/motion/planar.hpp>
#include <lamina/frontend/motion/scan_points.hpp>
#include <lamina/models/timestamp.hpp>

namespace lamina {

/// What one scan saw from where it stood, by bearing: free up to a range.
struct SightFan {
  static constexpr int kBins = 360;
  PlanarPose T_anchor_scanner;
  std::vector<float> nearest;  ///< m, per degree of bearing in the scanner frame; 0: not seen
};

/// What scans along a few metres saw, in the frame of the first one's body (the anchor).
struct SubmapViews {
  std::vector<OrientedPoint> points;  ///< anchor frame, thinned
  std::vector<SightFan> fans;         ///< of some of the scans
};

/// A few metres of the way; what was seen there, its SubmapViews, may be elsewhere.
struct Submap {
  Timestamp stamp;               ///< of the anchor
  std::uint64_t points = 0;      ///< of its views, once it is complete
  Eigen::Vector2d centre{0, 0};  ///< mean position of its scans, anchor frame
  PlanarPose T_anchor_end;       ///< to the next submap's anchor, by odometry
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of T_anchor_end, right tangent
  double travelled = 0, turned = 0;                      ///< m, rad
};

template <class A>
void fields(A& a, SightFan& v) {
  a(v.T_anchor_scanner, v.nearest);
}
template <class A>
void fields(A& a, SubmapViews& v) {
  a(v.points, v.fans);
}
template <class A>
void fields(A& a, Submap& v) {
  a(v.stamp, v.points, v.centre, v.T_anchor_end, v.covariance, v.travelled, v.turned);
}

/// The fan of points seen from a scanner at `scanner` (both in the body frame) from a body at
/// T_anchor_body.
SightFan sight_fan(const std::vector<OrientedPoint>& points_body, const Eigen::Vector2d& scanner,
                   const PlanarPose& T_anchor_body);

/// How points b agree with what fans a saw, when b's frame stands at T_a_b.
struct FanAgreement {
  int agree = 0;       ///< views of a point at the range that was seen
  int contradict = 0;  ///< views of a point where the fan saw farther: it should not be there
  double ratio() const {
    return agree + contradict > 0 ? static_cast<double>(agree) / (agree + contradict) : 0.0;
  }
};

/// Counts for each point of b the nearest fan of a that looks its way: agreement within `margin`
/// (m, + 2 % of the range), contradiction when the fan saw beyond, no vote when it is hidden.
FanAgreement agreement(const std::vector<SightFan>& fans_a,
                       const std::vector<OrientedPoint>& points_b, const PlanarPose& T_a_b,
                       double margin);

}  // namespace lamina
