// What planes tell of the bend of a depth camera's image.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include <lamina/frontend/depth/blocks.hpp>
#include <lamina/frontend/depth/depth_distortion.hpp>
#include <lamina/frontend/depth/floor_result.hpp>
#include <lamina/pipeline/calibration/camera/plane_angles.hpp>
#include <lamina/sensors/calibration.hpp>

namespace lamina {

/// Gathers, over frames taken from different places, what is left when each plane seen is fitted to
/// its pixels: a bend of the sensor stays where it is in the image, whatever the plane. Least
/// squares over all planes, each one's own plane eliminated. As unsupervised calibration by maps
/// [Teichman2013], without the map. Frames go in turns of kTurn to two halves; what is learned from
/// one half must hold for the other. Where planes look askew to each other by more than chance, all
/// over the recording, their angles tell constant and slopes, too.
class DistortionEstimator {
 public:
  static constexpr int kTurn = 6;    ///< frames in a row that go to the same half
  static constexpr int kLeast = 24;  ///< frames without which nothing is told

  /// One frame, its disparities as measured, what the floor front-end found in it. Frames of
  /// another size than the first are left out.
  void add(const FloorResult& floor, const DisparityImage& disparities, const CameraModel& camera);
  int frames() const { return frames_; }
  /// The bend, of the largest degree that foretells the other half markedly better than the degree
  /// below, and with what angles tell where that is much; nullopt where nothing is told.
  std::optional<DepthDistortion> estimate() const;

 private:
  static constexpr int kTerms = DepthDistortion::terms(DepthDistortion::kMaxDegree);
  using Matrix = Eigen::Matrix<double, kTerms, kTerms>;
  using Vector = Eigen::Matrix<double, kTerms, 1>;
  /// Normal equations of the coefficients.
  struct Half {
    Matrix A = Matrix::Zero();
    Vector b = Vector::Zero();
    double square = 0;   ///< px^2, sum of squared residuals without any bend
    double samples = 0;  ///< block means, less the unknowns of their planes
    Half& operator+=(const Half& o);
    /// The least squares; constant and slopes are zero.
    Eigen::VectorXd solve(int terms) const;
    /// Mean square that coefficients leave (px^2).
    double left_by(const Eigen::VectorXd& coefficients) const;
  };
  /// Block means (x, y, disparity): x and y from -1 to 1 over the image. nullopt: too few of them
  /// for the plane's angles.
  std::optional<ImagePlane> add_plane(const std::vector<Eigen::Vector3d>& means,
                                      const CameraModel& camera, Half& half) const;
  int degree_by_planes() const;
  std::optional<Eigen::VectorXd> with_angles(const Half& all, int terms) const;
  DepthDistortion distortion_of(const Eigen::VectorXd& coefficients) const;

  int width_ = 0, height_ = 0, frames_ = 0;
  std::array<Half, 2> halves_;
  PlaneAngles angles_;
  int side_ = 0, columns_ = 0;  ///< of blocks, px; blocks in a row
  std::vector<int> seen_;       ///< frames whose planes have the block
};

}  // namespace lamina
