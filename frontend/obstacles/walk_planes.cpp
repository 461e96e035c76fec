// Which planes of a frame can be walked on.
#include <cmath>
#include <optional>

#include <lamina/frontend/obstacles/floor_walk.hpp>

namespace lamina {
namespace {

constexpr double kDegree = 0.017453292519943295;
// Frames after which the tracked mounting stands in for a floor that was not found.
constexpr int kTrackedFrames = 3;

// The floor under the camera by the tracked mounting; none as long as that is not known.
std::optional<WalkPlane> tracked_floor(const FloorResult& floor, const ScanView& view) {
  if (floor.mounting.frames < kTrackedFrames || !floor.mounting.rigid || !(view.height() > 0.01))
    return std::nullopt;
  const Eigen::Vector3d n = view.R.transpose() * Eigen::Vector3d(0, 0, 1);
  const double scale = -view.noise.focal_baseline / view.height();
  WalkPlane w;
  w.disparity = (scale * Eigen::Vector3d(n.x() / view.fx, n.y() / view.fy, n.z())).cast<float>();
  w.camera_height = static_cast<float>(view.height());
  return w;
}

}  // namespace

WalkPlanes walk_planes(const FloorResult& floor, const ScanView& view, const ScanOptions& options) {
  WalkPlanes out;
  out.of_label.assign(256, -1);
  const SE3 T = view.T_body_camera;
  const auto add = [&](std::size_t k) {
    const ExtractedPlane& p = floor.planes[k];
    const Eigen::Vector3d n = T.so3() * p.plane_camera.normal();
    if (n.z() < std::cos(options.max_slope_deg * kDegree) || out.planes.size() > 30) return;
    const double rho = p.plane_camera.rho() + n.dot(T.translation());
    WalkPlane w;
    w.disparity = p.disparity.cast<float>();
    w.body = Eigen::Vector3d(-n.x() / n.z(), -n.y() / n.z(), rho / n.z()).cast<float>();
    w.camera_height = static_cast<float>(-p.plane_camera.rho());
    if (!(w.camera_height > 0.01F)) return;
    if (k < 255) out.of_label[k + 1] = static_cast<std::int16_t>(out.planes.size());
    out.planes.push_back(w);
  };
  if (floor.dominant >= 0) {
    add(static_cast<std::size_t>(floor.dominant));
  } else if (const auto tracked = tracked_floor(floor, view)) {
    // Too close to a rim, or to the crest of a ramp, to say which plane is the floor.
    out.planes.push_back(*tracked);
    out.slack = 0.01F;
  }
  if (out.planes.empty()) return out;
  for (std::size_t k = 0; k < floor.planes.size(); ++k) {
    const ExtractedPlane& p = floor.planes[k];
    if (static_cast<int>(k) == floor.dominant || p.area < options.min_level_area_m2) continue;
    if (p.kind == PlaneKind::kSubDominant) add(k);
  }
  return out;
}

}  // namespace lamina
