// What may be wrong with the settings.
#include <lamina/frontend/segments/segment_options.hpp>

namespace lamina {
namespace {
void need(bool fine, const char* text, std::vector<std::string>& out) {
  if (!fine) out.emplace_back(text);
}
}  // namespace

std::vector<std::string> SegmentOptions::problems() const {
  std::vector<std::string> out;
  need(min_points >= 3, "segments.min_points: expected at least 3", out);
  need(min_length >= 0, "segments.min_length: expected at least 0 m", out);
  need(max_sigma_theta > 0, "segments.max_sigma_theta: expected more than 0", out);
  need(split_gain > 0, "segments.split_gain: expected more than 0", out);
  need(min_sigma > 0, "segments.min_sigma: expected more than 0 m", out);
  need(max_noise_scale >= 1, "segments.max_noise_scale: expected at least 1", out);
  need(gap_angle > 0 && gap_angle < 1.5, "segments.gap_angle: expected between 0 and 1.5", out);
  need(min_gap >= 0, "segments.min_gap: expected at least 0 m", out);
  need(max_bridge >= 0, "segments.max_bridge: expected at least 0 m", out);
  need(max_incidence > 0 && max_incidence < 1.57,
       "segments.max_incidence: expected between 0 and 1.57", out);
  need(outlier_sigma > 1, "segments.outlier_sigma: expected more than 1", out);
  need(max_reduced_chi >= 1, "segments.max_reduced_chi: expected at least 1", out);
  need(min_fill >= 0 && min_fill <= 1, "segments.min_fill: expected between 0 and 1", out);
  return out;
}

std::vector<std::string> TrackingOptions::problems() const {
  std::vector<std::string> out;
  need(gate > 0, "tracking.gate: expected more than 0", out);
  need(max_angle > 0, "tracking.max_angle: expected more than 0", out);
  need(max_offset > 0, "tracking.max_offset: expected more than 0 m", out);
  need(slack_rho >= 0 && slack_theta >= 0 && slack_overlap >= 0,
       "tracking.slack_*: expected at least 0", out);
  need(min_observations >= 1, "tracking.min_observations: expected at least 1", out);
  need(max_coast_s >= 0, "tracking.max_coast_s: expected at least 0 s", out);
  need(max_coast_scans >= 0, "tracking.max_coast_scans: expected at least 0", out);
  need(sigma_tilt > 0, "tracking.sigma_tilt: expected more than 0", out);
  need(bend_threshold > 0, "tracking.bend_threshold: expected more than 0", out);
  need(no_odometry_sigma_m > 0 && no_odometry_sigma_rad > 0,
       "tracking.no_odometry_sigma_*: expected more than 0", out);
  return out;
}

}  // namespace lamina
