// Generous: they keep out what is a slip of the hand, not what is unusual.
#include <lamina/pipeline/config/setting_ranges.hpp>

#include <map>
#include <sstream>
#include <stdexcept>

#include <lamina/pipeline/config/setting.hpp>

namespace lamina {

namespace {

const std::map<std::string, SettingRange> kRanges{
    {"threads", {1, 1024}},
    {"checkpoint.interval_s", {1e-3, 1e6}},
    {"grid.resolution_m", {0.005, 10}},
    {"robot.height_m", {0.01, 100}},
    {"robot.radius_m", {0, 100}},
    {"robot.max_step_m", {1e-3, 10}},
    {"robot.max_slope_deg", {0.1, 85}},
    {"lidar.range_sigma", {0, 10}},
    {"lidar.field_of_view_deg", {0, 360}},
    {"lidar.sweep_s", {-10, 10}},
    {"lidar.delay_s", {-10, 10}},
    {"camera.delay_s", {-10, 10}},
    {"odometry.delay_s", {-10, 10}},
    {"floor.sections", {1, 100}},
    {"floor.roi_m", {0.01, 1000}},
    {"floor.time_budget_ms", {0, 1e6}},
    {"floor.recursion_limit", {1, 1000}},
    {"floor.hypotheses", {1, 1e6}},
    {"floor.distance_sigmas", {0.1, 100}},
    {"floor.prior_cone_deg", {0.1, 90}},
    {"floor.false_alarm", {1e-12, 0.5}},
    {"floor.surfel_m", {0.001, 10}},
    {"obstacles.angle_increment_deg", {0, 90}},
    {"obstacles.range_max_m", {0, 1000}},
    {"obstacles.min_hole_depth_m", {0, 100}},
    {"obstacles.noise_sigmas", {0.1, 100}},
    {"obstacles.grazing_deg", {1, 90}},
    {"segments.min_points", {2, 1e6}},
    {"segments.min_length_m", {1e-3, 1000}},
    {"segments.max_bridge_m", {0, 1000}},
    {"tracking.gate", {0.1, 1e6}},
    {"tracking.min_observations", {1, 1e6}},
    {"tracking.max_coast_s", {0, 1e6}},
    {"scan_odometry.key_scans", {1, 1e6}},
    {"scan_odometry.map_radius_m", {0.1, 1e6}},
    {"loops.submap_length_m", {0.01, 1e6}},
    {"loops.max_window_m", {0.01, 1e4}},
    {"loops.min_score", {0, 1}},
    {"loops.max_ambiguity", {0, 1}},
    {"mountings.sigma_heading_deg", {0, 90}},
    {"mountings.sigma_place_m", {0, 100}},
    {"window.keyframes", {2, 1e6}},
    {"window.dormant_planes", {0, 1e4}},
    {"window.seconds", {0, 1e9}},
    {"window.iterations", {1, 1000}},
    {"keyframe.distance_m", {1e-3, 1000}},
    {"keyframe.angle_deg", {0.01, 360}},
    {"keyframe.new_share", {0, 1}},
    {"planes.min_observations", {1, 1e6}},
    {"planes.outline_cell_m", {1e-3, 10}},
    {"planes.prior_tilt_deg", {1e-3, 90}},
    {"association.max_distance_m", {1e-4, 100}},
    {"association.max_angle_deg", {0.01, 90}},
    {"association.max_gap_m", {0, 1000}},
    {"place_recognition.min_planes", {1, 1000}},
    {"surfels.cell_m", {1e-3, 10}},
    {"surfels.joint_cell_m", {1e-2, 10}},
    {"labels.level_tilt_deg", {0.01, 90}},
    {"labels.wall_tilt_deg", {0.01, 90}},
};

}  // namespace

std::optional<SettingRange> range_of(const std::string& key) {
  const auto found = kRanges.find(key);
  return found == kRanges.end() ? std::nullopt : std::optional(found->second);
}

void require_in_range(const std::string& key, const std::string& value) {
  const auto range = range_of(key);
  if (!range) return;
  std::stringstream numbers(value);
  for (std::string part; std::getline(numbers, part, ',');) {
    const auto first = part.find_first_not_of("[ \t"), last = part.find_last_not_of("] \t");
    double number = 0;
    try {
      text::read(first == std::string::npos ? "" : part.substr(first, last - first + 1), number);
    } catch (const std::invalid_argument&) {
      return;
    }
    if (number >= range->low && number <= range->high) continue;
    throw std::invalid_argument("a number from " + text::write(range->low) + " to " +
                                text::write(range->high));
  }
}

}  // namespace lamina
