// A straight piece of a 2D scan: a partial view of a plane.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include <lamina/models/moments.hpp>

namespace lamina {

/// The line x cos(theta) + y sin(theta) = rho of the scan plane between two end points, in the
/// scanner's frame (the scan lies in its x-y plane). rho >= 0 as the scanner sees it: the normal
/// (cos theta, sin theta) of the *line's equation* points away from the scanner; the plane it is
/// part of has the opposite normal, towards the side it was seen from.
struct ScanSegment {
  double rho = 0;                                        ///< m
  double theta = 0;                                      ///< rad, (-pi, pi]
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< of (rho, theta): m^2, m rad, rad^2
  Eigen::Vector2d start = Eigen::Vector2d::Zero();       ///< first end point by beam order, m
  Eigen::Vector2d end = Eigen::Vector2d::Zero();         ///< last end point, m
  /// Of its points (x, y, 0), weights 1/sigma^2 along the normal (1/m^2).
  Moments moments;
  int first_beam = 0, last_beam = 0;  ///< inclusive; last < first over the seam
  int count = 0;                      ///< points used in the fit
  double chi_squared = 0;             ///< of the fit, count - 2 degrees

  double length() const { return (end - start).norm(); }
  /// Plane normal in the scanner frame, in its x-y plane, towards the scanner.
  Eigen::Vector3d normal_towards_scanner() const { return {-std::cos(theta), -std::sin(theta), 0}; }
};

}  // namespace lamina
