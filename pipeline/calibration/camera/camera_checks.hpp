// A first look over a recording's cameras: do images agree with what is stated of them?
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <lamina/frontend/depth/floor_options.hpp>
#include <lamina/frontend/depth/mounting_check.hpp>
#include <lamina/models/warning.hpp>
#include <lamina/sensors/camera_corrected_recording.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

/// What the first tens of images say of their cameras.
struct CameraFindings {
  CameraFixes fixes;
  std::vector<Warning> warnings;
  /// Floors scatter in height and tilt: one image's floor says nothing of the mounting.
  bool floor_uneven = false;
  /// No image shows floor where the mounting says, and nothing was corrected: a camera that makes
  /// no free ground, unless later images do. The warning then; its id is empty where a cause is
  /// said.
  std::optional<Warning> no_ground;
};

/// Looks over the first images of depth cameras and stereo pairs: at most 600 of them, 40 where the
/// robot has moved in between, fewer where these show the floor as stated. `ended` asks to stop.
/// `recording` is used up.
CameraFindings check_cameras(Recording& recording, const FloorOptions& options,
                             const std::function<bool()>& ended);

/// What a verdict says to people: found, what it means, what was done (`corrected`). Empty id:
/// nothing.
Warning mounting_warning(const MountingVerdict& verdict, const CameraModel& stated, bool corrected);
/// Likewise, of a camera with no ground.
Warning floor_unseen_warning(const MountingVerdict& verdict, const CameraModel& stated);
/// What is said of a floor that scatters from image to image: depth that is stretched lets it lie
/// nearer and further but never turns it, a body that pitches turns it, ground that swells does
/// both. `levelled`: each image is by its own floor. Without id: nothing.
Warning floor_scatter_warning(const MountingVerdict& verdict, bool levelled);

}  // namespace lamina
