// A plane as a scanner follows it: three numbers in the scanner's frame, with covariance.
#pragma once

#include <Eigen/Core>
#include <optional>

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/observation.hpp>
#include <lamina/models/plane.hpp>
#include <lamina/models/scan_segment.hpp>

namespace lamina {

/// The line a plane is expected to leave in a scan, and how sure that is.
struct LinePrediction {
  double rho = 0;                                        ///< m
  double theta = 0;                                      ///< rad
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< of (rho, theta)
};

/// The plane x cos(theta) + y sin(theta) + k z = rho in the scanner's frame. Scaled so, a scan (z =
/// 0) observes rho and theta directly whatever the tilt k = tan(tilt against the scan's normal),
/// which stays unknown until the scanner has moved out of its own plane. With the unit normal of
/// spherical angles (t, p) this is rho / sin t, p of [FORMULAS: 2D lidar], k = cot t.
class PlaneFilter {
 public:
  /// Nothing: to be read from an archive.
  PlaneFilter() = default;
  /// Of a first sighting; tilt unknown with sigma_tilt (of k).
  PlaneFilter(const ScanSegment& segment, const NoiseFloor& floor, double sigma_tilt);
  /// Of an estimated plane in the scanner's frame with covariance in its boxplus tangent about the
  /// origin; nullopt when the plane is parallel to the scan or behind it.
  static std::optional<PlaneFilter> from_plane(const Plane& plane_scanner,
                                               const Eigen::Matrix3d& covariance);

  /// Moves it into the scanner's next frame. `motion_covariance`: of the motion, in the tangent
  /// (translation, rotation) of the new scanner frame. False when the plane can no longer be seen:
  /// parallel to the scan, or the scanner went through it.
  bool predict(const SE3& T_curr_prev, const Matrix6d& motion_covariance);
  LinePrediction line() const;
  /// Kalman update with a segment whose covariance is R (floor and all).
  void update(const ScanSegment& segment, const Eigen::Matrix2d& R);

  double tilt() const { return state_(2); }  ///< k
  double sigma_tilt() const { return std::sqrt(P_(2, 2)); }
  /// The plane itself, towards the scanner.
  Plane plane() const;

  /// For archives (models/archive.hpp): all that one call leaves to the next.
  template <class A>
  friend void fields(A& a, PlaneFilter& v) {
    a(v.state_, v.P_);
  }

 private:
  Eigen::Vector3d state_ = Eigen::Vector3d::Zero();  // rho, theta, k
  Eigen::Matrix3d P_ = Eigen::Matrix3d::Zero();
};

/// Covariance of (rho, theta) of a segment, what its points share included; the floor acts at its
/// centroid.
Eigen::Matrix2d observation_covariance(const ScanSegment& segment, const NoiseFloor& floor);

/// a - b in (-pi, pi].
double angle_difference(double a, double b);

}  // namespace lamina
