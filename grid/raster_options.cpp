// What settings of the rasterizer cannot be.
#include <lamina/grid/rasterizer.hpp>

namespace lamina {

std::vector<std::string> RasterOptions::problems() const {
  std::vector<std::string> found;
  const auto require = [&found](bool ok, const char* what) {
    if (!ok) found.emplace_back(what);
  };
  require(resolution >= 0.001 && resolution <= 10, "resolution must lie between 0.001 and 10 m");
  require(robot_height > 0, "robot_height must be above 0");
  require(max_step > 0, "max_step must be above 0");
  require(max_slope > 0 && max_slope < 1.5, "max_slope must lie between 0 and 1.5 rad");
  require(min_probability > 0.5 && min_probability < 1,
          "min_probability must lie between 0.5 and 1");
  require(steep_slope > 0 && steep_slope < 1.57, "steep_slope must lie between 0 and 1.57 rad");
  require(steep_factor >= 0 && steep_factor <= 1, "steep_factor must lie between 0 and 1");
  require(obstacle_confidence >= 0 && obstacle_confidence <= 1,
          "obstacle_confidence must lie between 0 and 1");
  require(disc_growth >= 1 && disc_growth <= 3, "disc_growth must lie between 1 and 3");
  require(edge_margin >= 0, "edge_margin must not be negative");
  require(level_gap > 0, "level_gap must be above 0");
  require(least_step >= 0 && least_even >= 0, "least_step and least_even must not be negative");
  require(patch_size >= 0, "patch_size must not be negative");
  require(plane_gap >= 0 && wall_gap >= plane_gap && plane_ring >= wall_gap && wall_near >= 0,
          "plane_gap and wall_near must not be negative, wall_gap not less than plane_gap, "
          "plane_ring not less than wall_gap");
  require(seed_radius >= 0 && seed_tolerance >= 0 && reference_reach >= seed_radius,
          "seed_radius and seed_tolerance must not be negative, reference_reach not less than "
          "seed_radius");
  return found;
}

}  // namespace lamina
