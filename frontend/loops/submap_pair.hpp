// Two submaps that may show one place: aligned, and asked whether they contradict.
#pragma once

#include <Eigen/Core>
#include <vector>

#include <lamina/frontend/motion/likelihood_grid.hpp>
#include <lamina/frontend/motion/line_matcher.hpp>
#include <lamina/frontend/motion/submap.hpp>

namespace lamina {

struct PlanarEstimate {
  PlanarPose pose;
  Eigen::Matrix3d covariance;  ///< right tangent
};

/// From one pose to the other: m, m, rad.
Eigen::Vector3d difference(const PlanarPose& from, const PlanarPose& to);

/// What the two saw, each in the frame of its anchor; poses are T_old_new.
struct SubmapPair {
  const PointMap& old_points;
  const std::vector<SightFan>& old_fans;
  const SubmapViews& newer;

  LineMatch align(const PlanarPose& start) const;
  /// By look_alike_elsewhere().
  bool ambiguous(const PlanarPose& start, const SearchWindow& window, double ratio) const;
  /// Share of the views of points, both ways, that do not contradict (FanAgreement).
  double agreement_ratio(const PlanarPose& T_old_new, double margin) const;
  /// Whether drift explains a match: by chi-squared of 3 degrees of freedom, or of place and
  /// heading each by its own, where a match from where drift led ends at the same place.
  bool consistent(const PlanarEstimate& by_drift, const PlanarEstimate& by_match,
                  double max_chi_squared) const;
};

}  // namespace lamina
