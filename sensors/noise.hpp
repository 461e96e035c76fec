// How sure a measurement is: one value type for depth sensors, one for lidars.
#pragma once

namespace lamina {

/// Noise of a depth sensor that works in disparity: depth Z = focal * baseline / disparity, and
/// noise in disparity is constant. Fields are the model; the named constructors cite their source.
struct DepthNoise {
  enum class Kind { kIdeal, kKinect, kStereo };
  Kind kind = Kind::kKinect;
  double focal_baseline = 0;   ///< f b, px m: disparity_px = focal_baseline / Z
  double disparity_sigma = 0;  ///< px, 1-sigma, per pixel
  double disparity_step = 0;   ///< px, quantisation step (0: none)
  double correlation_px = 0;   ///< px over which the noise of neighbours is alike (0: white)
  double disparity_floor = 0;  ///< px, 1-sigma, shared by all pixels of a patch: does not average
  double min_range = 0, max_range = 1e9;  ///< m

  /// [Khoshelham2012]: 1/Z linear in disparity, sigma_Z = 1.425e-3 Z^2.
  static DepthNoise kinect(double focal_px);
  /// sigma_Z = Z^2 / (f b) sigma_d.
  static DepthNoise stereo(double focal_px, double baseline, double disparity_sigma);
  static DepthNoise bumblebee_xb3_wide();
  static DepthNoise bumblebee_xb3_narrow();
  static DepthNoise d4xx(double focal_px, double baseline);
  static DepthNoise ideal(double focal_px);

  double disparity(double z) const { return focal_baseline / z; }
  /// sigma of one depth measurement at depth z (m).
  double sigma_depth(double z) const { return z * z / focal_baseline * disparity_sigma; }
  /// Depth step of the quantisation at z (m).
  double quantisation(double z) const { return z * z / focal_baseline * disparity_step; }
  /// sigma of height above a plane of a point at depth z, seen from h above the plane (m): z error
  /// times h / z.
  double sigma_height(double z, double h) const { return sigma_depth(z) * h / z; }
  /// Lateral sigma in pixels at incidence angle theta (rad): [Nguyen2012].
  double sigma_lateral_px(double theta) const;
  /// sigma of what all points of a patch at z share (m along the ray).
  double correlated_floor(double z) const { return z * z / focal_baseline * disparity_floor; }
  /// How many pixels make one independent measurement: (correlation area, at least 1).
  double pixels_per_sample() const;
};

/// Noise of a 2D lidar.
struct LidarNoise {
  double range_sigma = 0.01;    ///< m, 1-sigma
  double angle_sigma = 0.0005;  ///< rad, 1-sigma, per beam
  double range_floor = 0.002;   ///< m, shared by all beams on one surface: does not average
};

/// [Nguyen2012]: sigma_Z = 0.0012 + 0.0019 (Z - 0.4)^2 m up to 60 deg of incidence, and a term
/// that grows beyond.
double nguyen_sigma_depth(double z, double incidence);

}  // namespace lamina
