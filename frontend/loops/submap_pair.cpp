// Alignment of two submaps, and its tests against views and drift.
#include <lamina/frontend/loops/submap_pair.hpp>

#include <Eigen/LU>
#include <algorithm>

#include <lamina/frontend/loops/perceptual_aliasing.hpp>

namespace lamina {
namespace {

double chi_squared(const Eigen::Vector3d& e, const Eigen::Matrix3d& S) {
  return e.dot(S.inverse() * e);
}

// Of place (2 dof, m) and heading (rad), each by its own: what they have to do with each other
// depends on where on the way the drift arose. A chained covariance spreads it over all of the way,
// and takes what one bad match in a place with little to see does for impossible.
double chi_squared_between(const Eigen::Vector3d& e, const Eigen::Matrix3d& S) {
  const Eigen::Vector2d t = e.head<2>();
  return t.dot(S.topLeftCorner<2, 2>().inverse() * t) + e.z() * e.z() / S(2, 2);
}

}  // namespace

Eigen::Vector3d difference(const PlanarPose& from, const PlanarPose& to) {
  const PlanarPose d = from.inverse() * to;
  return {d.x, d.y, d.yaw};
}

LineMatch SubmapPair::align(const PlanarPose& start) const {
  LineMatchOptions fine;
  fine.start_radius = 0.4;
  return match_lines(old_points, newer.points, start, {}, fine);
}

bool SubmapPair::ambiguous(const PlanarPose& start, const SearchWindow& window,
                           double ratio) const {
  return look_alike_elsewhere(old_points.points(), old_fans, newer.points, start, window, ratio);
}

double SubmapPair::agreement_ratio(const PlanarPose& T_old_new, double margin) const {
  return std::min(agreement(old_fans, newer.points, T_old_new, margin).ratio(),
                  agreement(newer.fans, old_points.points(), T_old_new.inverse(), margin).ratio());
}

bool SubmapPair::consistent(const PlanarEstimate& by_drift, const PlanarEstimate& by_match,
                            double max_chi_squared) const {
  const Eigen::Vector3d e = difference(by_drift.pose, by_match.pose);
  const Eigen::Matrix3d S = by_drift.covariance + by_match.covariance;
  if (!(chi_squared(e, S) > max_chi_squared)) return true;
  if (chi_squared_between(e, S) > max_chi_squared) return false;
  // A place that looks alike lies farther off than a match reaches.
  const LineMatch near = align(by_drift.pose);
  return chi_squared(difference(near.T_map_scan, by_match.pose), by_match.covariance) <=
         max_chi_squared;
}

}  // namespace lamina
