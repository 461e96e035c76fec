// What can be wrong with the settings.
#include <lamina/frontend/depth/floor_options.hpp>

namespace lamina {

std::vector<std::string> FloorOptions::problems() const {
  std::vector<std::string> found;
  const auto need = [&found](bool good, const char* message) {
    if (!good) found.emplace_back(message);
  };
  need(roi_m[0] > 0 && roi_m[1] > 0 && roi_m[2] > 0, "floor.roi_m: all three must be > 0");
  need(roi_m[0] <= 50 && roi_m[1] <= 50, "floor.roi_m: length and width at most 50 m");
  need(sections[0] >= 1 && sections[1] >= 1 && sections[0] <= 64 && sections[1] <= 64,
       "floor.sections: both from 1 to 64");
  need(roi_depth_below_m >= 0, "floor.roi_depth_below_m: must be >= 0");
  need(time_budget_ms >= 0, "floor.time_budget_ms: must be >= 0");
  need(block_px >= 4 && block_px <= 32, "floor.block_px: from 4 to 32");
  need(outlier_alpha > 0, "floor.outlier_alpha: must be > 0");
  need(min_block_fill > 0 && min_block_fill <= 1, "floor.min_block_fill: in (0, 1]");
  need(hypotheses >= 1, "floor.hypotheses: at least 1");
  need(recursion_limit >= 1, "floor.recursion_limit: at least 1");
  need(distance_sigmas > 0, "floor.distance_sigmas: must be > 0");
  need(prior_cone_deg > 0 && prior_cone_deg <= 180, "floor.prior_cone_deg: in (0, 180]");
  need(unknown_cone_deg > 0 && unknown_cone_deg <= 180, "floor.unknown_cone_deg: in (0, 180]");
  need(min_plane_px >= 64, "floor.min_plane_px: at least 64");
  need(traversable_slope_deg > 0 && traversable_slope_deg < 90,
       "floor.traversable_slope_deg: in (0, 90)");
  need(min_height_m >= 0 && max_height_m > min_height_m,
       "floor.max_height_m: must be above floor.min_height_m");
  need(confirm_frames >= 1, "floor.confirm_frames: at least 1");
  need(cell_m >= 0.01 && cell_m <= 1, "floor.cell_m: from 0.01 to 1 m");
  need(false_alarm > 0 && false_alarm < 0.5, "floor.false_alarm: in (0, 0.5)");
  need(min_obstacle_cells >= 1, "floor.min_obstacle_cells: at least 1");
  need(local_floor_m > 0, "floor.local_floor_m: must be > 0");
  need(surfel_m > 0, "floor.surfel_m: must be > 0");
  return found;
}

}  // namespace lamina
