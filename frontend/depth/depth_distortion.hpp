// What a depth camera's images have wrong in every frame, and its removal.
#pragma once

#include <Eigen/Core>
#include <vector>

#include <lamina/models/depth_camera_error.hpp>
#include <lamina/sensors/depth_frame.hpp>

namespace lamina {

/// Error of the disparity over the image, the same in every frame [Herrera2012]:
///   d measured - d true = sum c_ij P_i(x) P_j(y), i + j <= degree,
/// P Legendre polynomials, x and y from -1 to 1 over the image. Constant and slopes, the first
/// kAffine, turn and move planes: no plane alone tells them, the angles between planes do. Beside
/// it, a focal length that is not what is stated.
class DepthDistortion {
 public:
  static constexpr int kMaxDegree = 14;
  static constexpr int kAffine = 3;
  /// Coefficients up to a degree: 3, 6, 15, 28, 45, 66, 91, 120 for 1, 2, 4, ... 14.
  static constexpr int terms(int degree) { return (degree + 1) * (degree + 2) / 2; }
  /// The products P_i(x) P_j(y) by degree, the first `terms(degree)` in all of them.
  static Eigen::VectorXd basis(double x, double y, int degree);

  DepthDistortion() = default;
  /// `coefficients` in px of disparity; their number says the degree. Throws lamina::Error for
  /// other numbers or an empty image.
  DepthDistortion(int width, int height, const Eigen::VectorXd& coefficients);

  /// Values beyond these (px) are held to them.
  void hold_within(double low, double high);
  /// Adds errors for frames like this one (uncorrected); to none, too. Does nothing where the frame
  /// has another size or no noise model.
  void add(const DepthCameraError& error, const DepthFrame& like);
  /// Takes the error out of the measurements of a frame of that size, and gives it the focal length
  /// that is; others stay as they are, as do frames without a noise model. Pixels without
  /// measurement, and saturated ones, too. Once a frame.
  void correct(DepthFrame& frame) const;
  bool empty() const { return field_.empty(); }
  /// px of disparity, row-major.
  const std::vector<float>& field() const { return field_; }
  double rms() const;      ///< px, over the image
  double largest() const;  ///< px, of either sign

 private:
  int width_ = 0, height_ = 0;
  std::vector<float> field_;
  double focal_ = 1;  ///< the stated focal length over the one that is
};

}  // namespace lamina
