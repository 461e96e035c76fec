// What can be wrong with the settings of the obstacle scans.
#include <lamina/frontend/obstacles/scan_options.hpp>

namespace lamina {

std::vector<std::string> ScanOptions::problems() const {
  std::vector<std::string> out;
  const auto need = [&](bool good, const char* text) {
    if (!good) out.emplace_back(text);
  };
  need(angle_increment_deg >= 0 && angle_increment_deg <= 10,
       "scan.angle_increment_deg: expected 0 to 10");
  need(range_max_m >= 0, "scan.range_max_m: expected 0 or more");
  need(robot_height_m > 0, "scan.robot_height_m: expected more than 0");
  need(max_step_m > 0 && max_step_m < robot_height_m,
       "scan.max_step_m: expected more than 0 and less than robot_height_m");
  need(max_slope_deg > 0 && max_slope_deg < 60, "scan.max_slope_deg: expected 0 to 60");
  need(min_hole_depth_m > 0, "scan.min_hole_depth_m: expected more than 0");
  need(min_level_area_m2 > 0, "scan.min_level_area_m2: expected more than 0");
  need(noise_sigmas >= 2 && noise_sigmas <= 20, "scan.noise_sigmas: expected 2 to 20");
  need(min_run_px >= 1 && min_run_px <= 20, "scan.min_run_px: expected 1 to 20");
  need(max_gap_m > 0, "scan.max_gap_m: expected more than 0");
  need(max_faded_gap_m >= max_gap_m, "scan.max_faded_gap_m: expected max_gap_m or more");
  need(grazing_deg > 30 && grazing_deg < 90, "scan.grazing_deg: expected 30 to 90");
  need(lost_deg >= grazing_deg && lost_deg < 90, "scan.lost_deg: expected grazing_deg to 90");
  need(local_floor_m > 0, "scan.local_floor_m: expected more than 0");
  need(document_tolerance_m > 0, "scan.document_tolerance_m: expected more than 0");
  return out;
}

}  // namespace lamina
