// A reference that follows a marker somewhere on the robot, by a clock of its own.
#pragma once

#include <optional>

#include <lamina/models/trajectory.hpp>

namespace lamina {

struct MarkerFitOptions {
  bool lever = false, clock = false;  ///< what is fitted
  double max_gap = 0.5;               ///< s, between samples of the reference
  int iterations = 30;
  double step_s = 0.05;          ///< half the time over which the reference's velocity is taken
  double open = 1e-4;            ///< share of the best observed direction's curvature: not observed
  std::size_t least_pairs = 10;  ///< poses with a reference
};

struct MarkerFit {
  Eigen::Vector3d lever_body = Eigen::Vector3d::Zero();  ///< m, from the body to the marker
  double clock_s = 0;  ///< what the reference's clock shows more than the estimate's

  /// The marker's path by the reference's clock: the body's attitudes, moved by the lever.
  Trajectory of_marker(const Trajectory& estimate) const;
};

/// By Gauss-Newton over lever, clock and the alignment [Umeyama1991] together, least squares of the
/// distances between marker and reference. What the path leaves open (the lever's height where it
/// is level) stays 0. nullopt when fewer than ten stamps meet.
std::optional<MarkerFit> fit_marker(const Trajectory& estimate, const Trajectory& reference,
                                    const MarkerFitOptions& options);

}  // namespace lamina
