// Corrections, told in degrees and centimetres.
#include <lamina/apps/calibration.hpp>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cmath>

#include <lamina/apps/mounting_calibration.hpp>
#include <lamina/apps/wheel_calibration.hpp>

namespace lamina::apps {

void correct_wheels(std::vector<Step>& steps, const MapperOptions& options, io::Metrics& metrics,
                    const std::function<bool()>& ended) {
  if (!wheels_and_images_alone(steps)) return;
  const auto timer = metrics.time("wheels");
  const auto errors = calibrate_wheels(steps, options, ended);
  if (!errors) return;
  constexpr double kDegree = M_PI / 180;
  const Eigen::Vector4d sigma = errors->covariance.diagonal().cwiseSqrt();
  spdlog::info(
      "wheels corrected by: scale {:+.4f} +- {:.4f}, drift {:+.3f} +- {:.3f} deg/m, turns "
      "{:+.4f} +- {:.4f}; camera turned by {:+.2f} +- {:.2f} deg",
      errors->value(0), sigma(0), errors->value(1) / kDegree, sigma(1) / kDegree, errors->value(2),
      sigma(2), -errors->value(3) / kDegree, sigma(3) / kDegree);
  metrics.counts["wheel_scale_correction"] = errors->value(0);
  metrics.counts["wheel_drift_correction_deg_per_m"] = errors->value(1) / kDegree;
  metrics.counts["wheel_turn_correction"] = errors->value(2);
  metrics.counts["camera_turned_z_deg"] -= errors->value(3) / kDegree;
}

void correct_mountings(std::vector<Step>& steps, std::vector<LoopClosure>& loops, bool planar,
                       io::Metrics& metrics) {
  constexpr double kDegree = M_PI / 180;
  for (const auto& [sensor, told_by, correction] : calibrate_mountings(steps, loops, planar)) {
    const Eigen::Vector3d degrees = correction.rotation_body / kDegree;
    const Eigen::Vector3d cm = 100 * correction.translation_body;
    spdlog::info(
        "{} remounted by {}: turned by ({:+.2f}, {:+.2f}, {:+.2f}) deg, moved by ({:+.1f}, "
        "{:+.1f}, {:+.1f}) cm",
        sensor, told_by, degrees.x(), degrees.y(), degrees.z(), cm.x(), cm.y(), cm.z());
    for (int k = 0; k < 3; ++k) {
      const char axis = "xyz"[k];
      metrics.counts[fmt::format("{}_turned_{}_deg", sensor, axis)] += degrees(k);
      metrics.counts[fmt::format("{}_moved_{}_cm", sensor, axis)] += cm(k);
    }
  }
}

}  // namespace lamina::apps
