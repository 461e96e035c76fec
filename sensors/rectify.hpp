// Takes lens distortion out of images.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include <lamina/sensors/calibration.hpp>

namespace lamina {

/// Where the ray through an undistorted pixel falls in the distorted image (px), by the
/// Brown-Conrady model [Brown1966]: radial k1 k2 k3, tangential p1 p2.
Eigen::Vector2d distort_pixel(const CameraModel& camera, double u, double v);

/// Resamples images of one camera to a pinhole of the same focal lengths and principal point. The
/// map is computed once; depth takes the nearest pixel (averages of depths across an edge are
/// surfaces that do not exist), grey images are interpolated.
class Rectifier {
 public:
  explicit Rectifier(const CameraModel& camera);
  /// False when the camera has no distortion: images pass unchanged.
  bool needed() const { return !nearest_.empty(); }
  /// Pixels whose ray falls outside the image become 0.
  std::vector<std::uint16_t> depth(const std::vector<std::uint16_t>& raw) const;
  std::vector<std::uint8_t> grey(const std::vector<std::uint8_t>& image) const;

 private:
  int width_, height_;
  std::vector<std::int32_t> nearest_;      // index in the distorted image, -1: outside
  std::vector<Eigen::Vector2f> position_;  // the same, exact (px)
};

/// The camera without its distortion.
CameraModel undistorted(CameraModel camera);

}  // namespace lamina
