// Returns that lie where scans before saw through: of things that came there since.
#pragma once

#include <vector>

#include <lamina/frontend/motion/line_matcher.hpp>
#include <lamina/frontend/motion/submap.hpp>

namespace lamina {

/// Which points two fans or more saw through: by more than `margin` (m) and 2 % of their range, in
/// the bearing of a point and in those beside it. T_fans_points: from the points' frame into that
/// of the fans' anchor.
std::vector<bool> seen_through(const std::vector<OrientedPoint>& points,
                               const std::vector<SightFan>& fans, const PlanarPose& T_fans_points,
                               double margin);

/// The share of points in whose bearing a fan has a return at all: what no fan looked at can be
/// compared with nothing.
double looked_at(const std::vector<OrientedPoint>& points, const std::vector<SightFan>& fans,
                 const PlanarPose& T_fans_points);

/// The points without those that `came`, and without what lies within 30 cm of these: their rims.
std::vector<OrientedPoint> without(const std::vector<OrientedPoint>& points,
                                   const std::vector<bool>& came);

/// What match_lines() minimises, at T: sum rho((n_i . (T p_i - q_i))^2 / sigma_i^2) / 2 over the
/// oriented points' nearest ones in the map, with the weights of its last iterations, and the
/// prior's. A point that meets nothing within end_radius costs as much as one at its rim.
double match_cost(const PointMap& map, const std::vector<OrientedPoint>& scan, const PlanarPose& T,
                  const PlanarPrior& prior, const LineMatchOptions& options);

}  // namespace lamina
