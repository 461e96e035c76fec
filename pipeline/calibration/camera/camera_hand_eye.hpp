// How a camera sits to the wheels, told by images' motions.
#pragma once

#include <optional>
#include <vector>

#include <lamina/frontend/motion/depth_odometry.hpp>
#include <lamina/frontend/motion/wheel_odometry.hpp>
#include <lamina/models/adoption.hpp>
#include <lamina/models/timestamp.hpp>
#include <lamina/pipeline/calibration/calibration_priors.hpp>
#include <lamina/pipeline/calibration/extrinsics.hpp>
#include <lamina/pipeline/calibration/mounting_evidence.hpp>

namespace lamina {

/// Gathers what images alone say of motions, from key frame to key frame, beside the wheels' motion
/// of the same pieces of way, and fits the wheels' errors (WheelErrors: heading and place of the
/// camera among them) to what they differ by:
///   planar part of log(T_wheels^-1 T_images) = J e + noise of both,
/// least squares with the prior of the errors over the directions that images hold. Noise is what
/// is stated, scaled for each component by what is left after the fit: a swaying camera misplaces
/// across the way, and one scale for all would keep of it what agrees with the estimate.
class CameraAgainstWheels {
 public:
  /// `camera_place`: where the camera is said to sit (m, body x and y).
  explicit CameraAgainstWheels(const Eigen::Vector2d& camera_place,
                               const DepthOdometryOptions& options = {});
  /// The motion from the image before to that of `stamp`. nullopt where wheels or the image do not
  /// tell it: the piece of way begins anew with the next key frame.
  void add(Timestamp stamp, const std::optional<Increment>& by_wheels, const DepthMotion& by_image);
  /// What must be done to the camera's mounting: heading, and place where it stands out
  /// (chi-squared 13.8; between 5 mm and 6 cm). nullopt where blocks left out do not fit better by
  /// it (models/adoption.hpp).
  std::optional<CorrectedMounting> correction() const;
  /// What was added says of the mounting, whether it stands out or not.
  MountingEvidence evidence() const;

 private:
  struct Piece {
    std::vector<SE3> wheels;                 ///< motions between its images
    Matrix6d covariance = Matrix6d::Zero();  ///< of all of them together
    SE3 T_images;
  };
  /// One direction of a piece's planar motion: value = row e + noise of variance 1 (before it is
  /// scaled).
  struct Fact {
    WheelErrors::Vector row;
    double value;
    int component;  ///< that the direction is nearest to: along, across, heading
    int block;
  };
  struct Fit {
    WheelErrors errors;
    Eigen::Vector3d noise;  ///< variance of a fact of each component
    bool holds(const Fact& fact) const;
  };
  void take(Timestamp stamp, const DepthMotion& by_image);
  Fit fit(const WheelPrior& prior) const;
  /// The facts of each block that the fit holds.
  std::vector<QuadraticBlock> by_blocks(const Fit& fit) const;

  DepthOdometryOptions options_;
  Eigen::Vector2d camera_place_;
  std::optional<Piece> piece_;  ///< since the last key frame
  std::vector<Fact> facts_;
  Blocks blocks_;
};

}  // namespace lamina
