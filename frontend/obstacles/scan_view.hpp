// The geometry of one frame: pixels against the levelled floor, and lines that lead outward.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include <lamina/frontend/depth/blocks.hpp>
#include <lamina/models/lie/se3.hpp>
#include <lamina/sensors/depth_frame.hpp>

namespace lamina {

/// A way outward over the floor: the image of a vertical plane through the optical centre.
/// Samples are spaced one pixel (along the longer image axis) from near to far.
struct WalkLine {
  double azimuth = 0;  ///< rad, body frame, about the camera's foot
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();  ///< its cosine and sine
  float u0 = 0, v0 = 0;                                  ///< first sample (px)
  float du = 0, dv = 0;                                  ///< step (px)
  bool exits_side = false;  ///< it leaves the image by its left or right border
  int samples = 0;          ///< up to the border of the image or the horizon
};

/// A frame's disparities with the levelled pose of its camera.
struct ScanView {
  const DisparityImage* image = nullptr;
  DepthNoise noise;
  double fx = 1, fy = 1, cx = 0, cy = 0;
  SE3 T_body_camera;
  Eigen::Matrix3d R;  ///< of T_body_camera
  Eigen::Vector3d t;
  double azimuth_from = 0, azimuth_to = 0;  ///< rad, body frame: what the image spans

  ScanView(const DepthFrame& frame, const DisparityImage& disparities, const SE3& T_body_camera);

  double height() const { return t.z(); }  ///< of the optical centre above z = 0 (m)
  /// Body-frame direction of a pixel, per metre of depth.
  Eigen::Vector3d ray(double u, double v) const {
    return R * Eigen::Vector3d((u - cx) / fx, (v - cy) / fy, 1);
  }
  Eigen::Vector3d point(double u, double v, double d) const {
    return t + ray(u, v) * (noise.focal_baseline / d);
  }
  /// The line at an azimuth; no samples when the floor there is outside the image.
  WalkLine line(double azimuth) const;

 private:
  void find_azimuths();
};

/// atan2 to 2e-6 rad: scans need one per pixel column and chunk.
inline float quick_atan2(float y, float x) {
  const float ax = std::abs(x), ay = std::abs(y);
  const float most = std::max(ax, ay);
  if (!(most > 0)) return 0;
  const float a = std::min(ax, ay) / most, s = a * a;
  // Odd minimax polynomial of atan on [0, 1] (Abramowitz and Stegun, 4.4.49).
  float r =
      a * (0.9999993329F +
           s * (-0.3332985605F +
                s * (0.1994653599F +
                     s * (-0.1390853351F +
                          s * (0.0964200441F +
                               s * (-0.0559098861F + s * (0.0218612288F - s * 0.0040540580F)))))));
  if (ay > ax) r = 1.57079637F - r;
  if (x < 0) r = 3.14159274F - r;
  return y < 0 ? -r : r;
}

}  // namespace lamina
