// Motions that wheels told, told better by depth images.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <lamina/frontend/frontend.hpp>
#include <lamina/frontend/motion/depth_odometry.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/pipeline/calibration/extrinsics.hpp>
#include <lamina/pipeline/calibration/mounting_evidence.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

using OpenRecording = std::function<std::unique_ptr<Recording>()>;

/// Images that tell clearly another motion than wheels.
struct AgainstWheels {
  std::int64_t images = 0;
  Timestamp first, last;
  double metres = 0, radians = 0;  ///< sums of what the wheels are off
};

/// What an image tells, against wheels that it contradicts, the images before it contradicted, or
/// none: nullopt where the wheels' motion stays.
class MotionBesideWheels {
 public:
  std::optional<Increment> add(Timestamp stamp, const DepthMotion& motion);
  const AgainstWheels& against() const { return against_; }

 private:
  AgainstWheels against_;
  Vector6d off_ = Vector6d::Zero();  ///< of the wheels, by the last image that told (m, rad)
};

/// Counts of it, and a warning where it is no slip that images mended.
void tell_against_wheels(const AgainstWheels& against, Diagnostics& metrics);

struct MotionsByImages {
  int observed = 0;                           ///< steps whose motions images tell now
  std::optional<CorrectedMounting> mounting;  ///< what was done to the camera's mounting
  MountingEvidence left;                      ///< what images say of it as it is then
  AgainstWheels against;                      ///< of the wheels
};

/// A second look over the depth images, once errors of wheels and mountings are out of the steps:
/// depth odometry with the wheels for a prior gives the motions between images, in all directions
/// that surfaces hold. Steps whose image is not there, or says nothing, keep the wheels' motion.
/// Where images and wheels tell that the camera sits otherwise than is said (CameraAgainstWheels),
/// and `remounting`, it is remounted and all images are looked at once more. Steps to another place
/// than wheels and images say (PlaceWatch) lose tracking. For steps of wheels and depth images
/// alone. `ended` returning true stops early.
MotionsByImages refine_motions_by_images(const OpenRecording& open,
                                         const DepthDistortion& distortion,
                                         std::vector<Step>& steps, bool remounting,
                                         const std::function<bool()>& ended);

}  // namespace lamina
