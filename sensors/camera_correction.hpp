// What a camera's calibration states wrongly, and the calibration as it should be.
#pragma once

#include <optional>

#include <lamina/sensors/calibration.hpp>

namespace lamina {

/// To be applied to a calibration and to every frame that carries it.
struct CameraCorrection {
  double focal = 1;                  ///< true focal length over the stated one
  double depth = 1;                  ///< true depth over the stated one, at the true focal length
  double offset = 0;                 ///< 1/m: 1 / depth as measured, less the true one
  bool along_ray = false;            ///< depths are distances from the camera, not along its axis
  bool mirrored = false;             ///< images are turned left to right
  std::optional<SE3> T_body_camera;  ///< in place of the stated one

  /// Not only the model of the camera.
  bool changes_depths() const { return offset != 0 || along_ray; }
  bool any() const {
    return focal != 1 || depth != 1 || mirrored || changes_depths() || T_body_camera.has_value();
  }
  /// fx, fy, the noise model of these, cx, depth_scale, T_body_camera.
  void apply(DepthCamera& camera) const;
  /// fx, fy, baseline (true depth = stated depth * focal * depth), T_body_camera.
  void apply(StereoCamera& camera) const;
};

}  // namespace lamina
