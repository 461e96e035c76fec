// Point-to-line scan matching in the plane: a map of oriented points, and Gauss-Newton over it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include <lamina/frontend/motion/planar.hpp>
#include <lamina/frontend/motion/scan_points.hpp>

namespace lamina {

/// Oriented points in square cells, for nearest-neighbour search. Immutable once built.
class PointMap {
 public:
  explicit PointMap(std::vector<OrientedPoint> points);
  PointMap() = default;

  const std::vector<OrientedPoint>& points() const { return points_; }
  bool empty() const { return points_.empty(); }
  /// Nearest point within `radius` whose normal agrees with `normal` (cosine at least 0.7; either
  /// may be unknown when `normal` is zero). Null when there is none. Ties: the first. `guess`, a
  /// point of this map that may be near, saves work and changes nothing.
  const OrientedPoint* nearest(const Eigen::Vector2d& p, const Eigen::Vector2d& normal,
                               double radius, const OrientedPoint* guess = nullptr) const;

  /// For archives (models/archive.hpp): all that one call leaves to the next.
  template <class A>
  friend void fields(A& a, PointMap& v) {
    a(v.points_);
    if constexpr (A::kReading) v = PointMap(std::move(v.points_));  // in the same order
  }

 private:
  static constexpr double kLeastCell = 0.05;  // m: the nearest is mostly nearer than that

  std::vector<OrientedPoint> points_;  ///< sorted by cell
  std::vector<int> first_;             ///< per cell, row-major; one more at the end
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  double cell_ = kLeastCell;  ///< m
  int width_ = 0, height_ = 0;
};

struct LineMatchOptions {
  double start_radius = 0.8;  ///< m; correspondences at first: how wrong the start may be
  double end_radius = 0.15;   ///< m; at the end: what is no match is a new or moved thing
  int max_iterations = 25;
  double inlier_sigmas = 3;      ///< a match this near (and nearer than 5 cm anyway) is an inlier
  double samples_per_fact = 4;   ///< neighbouring returns share errors: this many count as one
  double min_information = 400;  ///< 1/m^2; a direction known worse than 5 cm is called unknown

  /// The same for returns with this noise (m): radii hold three sigmas of a difference, and a
  /// direction is unknown that is known worse than a single return.
  LineMatchOptions for_noise(double sigma) const;
};

/// A weak belief about the answer, in its right tangent.
struct PlanarPrior {
  PlanarPose T_map_scan;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  /// Cauchy's kernel over its chi-squared (of 3 dof): what wheels tell is wrong by many sigmas
  /// where they slip.
  bool robust = false;
  double weight(const PlanarPose& T_map_scan) const;  ///< 1 at the prior, and where not robust
};

struct LineMatch {
  PlanarPose T_map_scan;
  /// Of the scan alone, in the right tangent (x, y, yaw), per sigma model and samples_per_fact;
  /// directions below min_information are removed (zero).
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  int unknown_directions = 3;  ///< rank deficiency of `information`
  double matched = 0;          ///< fraction of oriented scan points that are inliers
  double rms = 0;              ///< m, of the inliers
  double prior_weight = 1;     ///< what the kernel left of the prior's information
  int iterations = 0;
  bool converged = false;
};

/// Minimises sum rho((n_i . (T p_i - q_i))^2 / sigma_i^2) + the prior's over T = T_map_scan, rho
/// Cauchy's, correspondences anew in every iteration within a radius that shrinks from start to
/// end. [Censi2008] (point-to-line metric), [Zhang2016] (directions without information keep the
/// start).
LineMatch match_lines(const PointMap& map, const std::vector<OrientedPoint>& scan,
                      const PlanarPose& start, const PlanarPrior& prior = {},
                      const LineMatchOptions& options = {});

}  // namespace lamina
