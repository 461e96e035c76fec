// Reading, planning, writing.
#include <lamina/pipeline/config/plan_on_map.hpp>

#include <lamina/io/grid_files.hpp>
#include <lamina/io/path_files.hpp>
#include <lamina/pipeline/config/settings.hpp>

namespace lamina {
namespace {

// The robot's radius and step of the run that made the map.
PlannerOptions options_of(const std::filesystem::path& map) {
  MapOptions settings;
  if (std::filesystem::exists(map / "config.yaml")) load(settings, map / "config.yaml");
  PlannerOptions options;
  options.robot_radius = settings.robot.radius;
  options.max_step = settings.robot.max_step;
  return options;
}

}  // namespace

Plan plan_on_map(const std::filesystem::path& map, const Eigen::Vector2d& from,
                 const Eigen::Vector2d& to) {
  const NavigabilityGrid grid = io::read_map_grid(map);
  Plan plan = plan_path(grid, from, to, options_of(map));
  if (plan.status == PlanStatus::kFound) {
    io::write_path_csv(map / "path.csv", plan.path_map);
    io::write_path_png(map / "path.png", grid, plan.path_map);
  } else {
    std::filesystem::remove(map / "path.csv");  // of an earlier one
    io::write_path_png(map / "path.png", grid, {from, to}, false);
  }
  return plan;
}

}  // namespace lamina
