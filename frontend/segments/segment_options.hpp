// Settings of the 2D-lidar front-end: extraction of segments, and their tracking.
#pragma once

#include <string>
#include <vector>

#include <lamina/sensors/calibration.hpp>

namespace lamina {

/// Split-and-merge. Everything that depends on the sensor is in units of its noise.
struct SegmentOptions {
  int min_points = 7;             ///< returns that a segment must have
  double min_length = 0.15;       ///< m; shorter pieces are loose points
  double max_sigma_theta = 0.07;  ///< rad; a direction less sure than this is no line
  /// Split where two lines explain the returns better than one by this much chi-squared (three
  /// parameters more, and the place was searched for), merge where they do not.
  double split_gain = 25;
  double corner_gate = 16;       ///< chi-squared above the best at which a corner may still be
  double min_sigma = 0.001;      ///< m; floor of the range noise, for ideal sensors
  double max_noise_scale = 4;    ///< the scan's own roughness may raise the noise this far
  double gap_angle = 0.17;       ///< rad; a break where neighbours' chord is closer to the beam
  double min_gap = 0.10;         ///< m; neighbours nearer than this (and 6 sigma) never break
  double max_bridge = 0.5;       ///< m; collinear pieces are joined over a shadow this long
  double max_incidence = 1.50;   ///< rad from the normal; beyond it is an edge of shadow
  double outlier_sigma = 4.0;    ///< returns further off their line are loose
  double max_reduced_chi = 2.0;  ///< with the scatter of chi-squared on top: worse fits are loose
  double min_fill = 0.5;         ///< share of the beams between its ends that a segment explains

  /// All that is wrong with it, one line each; empty when fine.
  std::vector<std::string> problems() const;
};

/// Following segments from scan to scan.
struct TrackingOptions {
  double gate = 16;               ///< chi-squared, 2 degrees: collinearity
  double max_angle = 0.35;        ///< rad; never match beyond, however unsure (equation 1)
  double max_offset = 1.0;        ///< m, at the segment's middle (equation 2)
  double slack_rho = 0.01;        ///< m; walls are not quite flat
  double slack_theta = 0.01;      ///< rad
  double slack_overlap = 0.3;     ///< m; end points wander (equation 3)
  double max_fragment_gap = 1.5;  ///< m; a second piece of a tracked wall this near shares its id
  int min_observations = 3;       ///< before a track counts; until then its id is -1
  double max_coast_s = 1.5;       ///< a track not seen this long ends...
  int max_coast_scans = 5;        ///< ...if it also missed this many scans
  double sigma_tilt = 1.5;        ///< of tan(tilt) of an unknown plane against the scan's normal
  double bend_threshold = 9;      ///< CUSUM of whitened innovations that ends a track as bent
  double bend_drift = 0.75;       ///< sigma per scan that the CUSUM forgives
  double no_odometry_sigma_m = 0.15;  ///< m a scan when no motion is given
  double no_odometry_sigma_rad = 0.09;
  double odometry_sigma_m = 0.003;    ///< m; least uncertainty of a given motion
  double odometry_sigma_rad = 0.002;  ///< rad
  OdometryModel odometry;             ///< how it grows with the motion

  /// All that is wrong with it, one line each; empty when fine.
  std::vector<std::string> problems() const;
};

}  // namespace lamina
