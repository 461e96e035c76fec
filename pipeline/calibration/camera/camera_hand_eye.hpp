// How a camera sits to the wheels, told by images' motions.
#pragma once

#include <optional>
#include <vector>

#include <lamina/frontend/motion/depth_odometry.hpp>
#include <lamina/frontend/motion/wheel_odometry.hpp>
#include <lamina/pipeline/calibration/calibration_priors.hpp>
#include <lamina/pipeline/calibration/mounting_evidence.hpp>

namespace lamina {

/// Gathers what images alone say of motions, from key frame to key frame, beside the wheels' motion
/// of the same pieces of way, and fits the wheels' errors (WheelErrors: heading and place of the
/// camera among them) to what they differ by:
///   planar part of log(T_wheels^-1 T_images) = J e + noise of both,
/// least squares with the prior of the errors over the directions that images hold. Noise is what
/// is stated, scaled by what is left after the fit.
class CameraAgainstWheels {
 public:
  /// `camera_place`: where the camera is said to sit (m, body x and y).
  explicit CameraAgainstWheels(const Eigen::Vector2d& camera_place,
                               const DepthOdometryOptions& options = {});
  /// The motion between two images. nullopt where wheels or the image do not tell it: the piece of
  /// way begins anew with the next key frame.
  void add(const std::optional<Increment>& by_wheels, const DepthMotion& by_image);
  /// What must be done to the camera's mounting; nullopt where neither heading (2.5 sigmas) nor
  /// place (chi-squared 13.8; between 5 mm and 6 cm) stands out.
  std::optional<MountingCorrection> correction() const;
  /// What was added says of the mounting, whether it stands out or not.
  MountingEvidence evidence() const;

 private:
  struct Piece {
    std::vector<SE3> wheels;                 ///< motions between its images
    Matrix6d covariance = Matrix6d::Zero();  ///< of all of them together
    SE3 T_images;
  };
  /// One direction of a piece: value = row e + noise of variance 1 (before it is scaled).
  struct Fact {
    WheelErrors::Vector row;
    double value;
  };
  void take(const DepthMotion& by_image);
  WheelErrors fit(const WheelPrior& prior) const;

  DepthOdometryOptions options_;
  Eigen::Vector2d camera_place_;
  std::optional<Piece> piece_;  ///< since the last key frame
  std::vector<Fact> facts_;
};

}  // namespace lamina
