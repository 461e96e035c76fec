// A calibration as it should be.
#include <lamina/sensors/camera_correction.hpp>

#include <lamina/sensors/intrinsics.hpp>

namespace lamina {
namespace {

void apply_to_model(const CameraCorrection& correction, CameraModel& camera) {
  camera.fx *= correction.focal;
  camera.fy *= correction.focal;
  if (correction.mirrored) camera.cx = camera.width - 1 - camera.cx;
  if (correction.T_body_camera) camera.T_body_camera = *correction.T_body_camera;
}

}  // namespace

void CameraCorrection::apply(DepthCamera& camera) const {
  apply_to_model(*this, camera.camera);
  camera.noise = noise_at_focal(camera.noise, focal);
  camera.depth_scale /= depth;
}

void CameraCorrection::apply(StereoCamera& camera) const {
  apply_to_model(*this, camera.camera);
  camera.baseline *= depth;
}

}  // namespace lamina
