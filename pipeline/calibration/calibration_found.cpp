// YAML by hand: numbers in the order of docs/formats.md.
#include <lamina/pipeline/calibration/calibration_found.hpp>

#include <fmt/format.h>

namespace lamina {
namespace {

std::string pose(const SE3& T) {
  const Eigen::Vector3d& t = T.translation();
  const Eigen::Quaterniond& q = T.so3().quaternion();
  return fmt::format(
      "    translation: [{:.9g}, {:.9g}, {:.9g}]\n"
      "    rotation_xyzw: [{:.9g}, {:.9g}, {:.9g}, {:.9g}]\n",
      t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

std::string camera(const CameraModel& c, double focal_scale) {
  std::string text = fmt::format(
      "  width: {}\n  height: {}\n  fx: {:.9g}\n  fy: {:.9g}\n  cx: {:.9g}\n  cy: {:.9g}\n",
      c.width, c.height, c.fx * focal_scale, c.fy * focal_scale, c.cx, c.cy);
  if (c.distortion) {
    const auto& d = *c.distortion;
    text += fmt::format("  distortion: [{:.9g}, {:.9g}, {:.9g}, {:.9g}, {:.9g}]\n", d[0], d[1],
                        d[2], d[3], d[4]);
  }
  return text + "  T_body_camera:\n" + pose(c.T_body_camera);
}

std::string depth_camera(const DepthCamera& depth, double focal_scale) {
  const DepthNoise& noise = depth.noise;
  std::string text = "depth_camera:\n";
  if (noise.kind == DepthNoise::Kind::kStereo) {
    text += fmt::format("  model: stereo\n  baseline: {:.9g}\n  disparity_sigma: {:.9g}\n",
                        noise.focal_baseline / depth.camera.fx, noise.disparity_sigma);
  } else {
    text += noise.kind == DepthNoise::Kind::kIdeal ? "  model: ideal\n" : "  model: kinect\n";
  }
  return text + fmt::format("  depth_scale: {:.9g}\n", depth.depth_scale) +
         camera(depth.camera, focal_scale);
}

// What was found, before and after; what is no part of calibration.yaml by its setting.
std::string remarks(const Diagnostics& metrics) {
  std::string text;
  for (const CalibrationEntry& e : metrics.calibration) {
    if (!e.adopted) continue;
    text += fmt::format("# {}: {:.6g} stated, {:.6g} found", e.parameter, e.stated, e.found);
    text += e.sigma > 0 ? fmt::format(", +- {:.2g}\n", e.sigma) : "\n";
  }
  return text.empty() ? "# nothing was corrected\n" : text;
}

}  // namespace

void MountingsUsed::add(const Step& step) {
  const bool other = step.scan && !step.scan_motion;  // an upright scanner beside a level one
  if (step.observations.planes.empty() && step.observations.segments.empty() && !step.scan) return;
  const SensorKind kind = step.scan ? SensorKind::kLidar : step.observations.sensor;
  Mounting& mounting = by_kind_[kind];
  const SE3& T = step.observations.T_body_sensor;
  if (mounting.count++ == 0) mounting.first = T;
  mounting.last = T;
  if (kind != SensorKind::kLidar) return;
  constexpr double kSame = 1e-6;
  several_scanners_ =
      several_scanners_ || other || (mounting.first.inverse() * T).log().norm() > kSame;
}

Calibration MountingsUsed::over(Calibration stated) const {
  const auto last = [this](SensorKind kind) -> std::optional<SE3> {
    const auto found = by_kind_.find(kind);
    return found == by_kind_.end() ? std::nullopt : std::optional(found->second.last);
  };
  const bool standing = stated.odometry.planar;
  if (const auto T = last(SensorKind::kLidar); T && !several_scanners_) {
    if (!stated.lidar) stated.lidar.emplace();
    stated.lidar->T_body_lidar = *T;
  }
  if (const auto T = last(SensorKind::kDepth); T && stated.depth_camera && standing)
    stated.depth_camera->camera.T_body_camera = *T;
  if (const auto T = last(SensorKind::kStereo); T && stated.stereo_camera && standing)
    stated.stereo_camera->camera.T_body_camera = *T;
  return stated;
}

std::string calibration_found(const Calibration& used, const Diagnostics& metrics) {
  std::string text = "# What self-calibration ended with; give it by --calibration.\n";
  text += remarks(metrics);
  double focal_scale = 1;
  for (const CalibrationEntry& e : metrics.calibration) {
    if (e.adopted && e.parameter == "depth_camera.fx_px") focal_scale = e.found / e.stated;
  }
  if (used.depth_camera) text += depth_camera(*used.depth_camera, focal_scale);
  if (used.stereo_camera) {
    const StereoCamera& stereo = *used.stereo_camera;
    text += "stereo_camera:\n" + camera(stereo.camera, 1) +
            fmt::format("  baseline: {:.9g}\n  disparity_sigma: {:.9g}\n", stereo.baseline,
                        stereo.disparity_sigma);
  }
  if (used.lidar) {
    text += fmt::format("lidar:\n  range_sigma: {:.9g}\n  angle_sigma: {:.9g}\n  T_body_lidar:\n",
                        used.lidar->noise.range_sigma, used.lidar->noise.angle_sigma) +
            pose(used.lidar->T_body_lidar);
  }
  const OdometryModel& o = used.odometry;
  text += fmt::format(
      "odometry:\n  sigma_translation: {:.9g}\n  sigma_rotation: {:.9g}\n"
      "  sigma_rotation_turn: {:.9g}\n  planar: {}\n",
      o.sigma_translation, o.sigma_rotation, o.sigma_rotation_turn, o.planar);
  return text;
}

}  // namespace lamina
