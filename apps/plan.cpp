// `lamina plan`: the shortest safe path on a map's grid.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>

#include <lamina/apps/verbs.hpp>
#include <lamina/grid/planner.hpp>
#include <lamina/io/grid_files.hpp>
#include <lamina/io/map_folder.hpp>
#include <lamina/io/path_files.hpp>
#include <lamina/models/error.hpp>
#include <lamina/pipeline/config/settings.hpp>

namespace lamina::apps {
namespace {

Eigen::Vector2d point_of(const std::string& text, const std::string& option) {
  std::array<double, 2> xy{};
  try {
    text::read("[" + text + "]", xy);
  } catch (const std::invalid_argument&) {
    throw Error(option + ": found '" + text + "', expected X,Y in metres");
  }
  constexpr double kFurthest = 1e6;  // m: cells beyond have no number
  if (std::max(std::abs(xy[0]), std::abs(xy[1])) > kFurthest) {
    throw Error(option + ": found '" + text + "', expected X,Y in metres, within 1000 km");
  }
  return {xy[0], xy[1]};
}

// The robot's radius and step of the run that made the map.
PlannerOptions options_of(const std::filesystem::path& map) {
  MapOptions settings;
  if (std::filesystem::exists(map / "config.yaml")) load(settings, map / "config.yaml");
  PlannerOptions options;
  options.robot_radius = settings.robot.radius;
  options.max_step = settings.robot.max_step;
  return options;
}

int plan(const std::filesystem::path& map, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  if (!std::filesystem::exists(map / "grid" / "grid.yaml")) io::require_map_folder(map);
  const NavigabilityGrid grid = io::read_grid(map / "grid").grid;
  const Plan plan = plan_path(grid, from, to, options_of(map));
  if (plan.status != PlanStatus::kFound) {
    io::write_path_png(map / "path.png", grid, {from, to}, false);
    std::cerr << "lamina: no path: " << plan.reason << '\n';
    return kFailed;
  }
  for (const Eigen::Vector2d& p : plan.path_map) fmt::print("{:.3f},{:.3f}\n", p.x(), p.y());
  io::write_path_csv(map / "path.csv", plan.path_map);
  io::write_path_png(map / "path.png", grid, plan.path_map);
  std::cerr << fmt::format("{:.2f} m, {} waypoints; wrote path.csv, path.png\n", plan.length,
                           plan.path_map.size());
  return kDone;
}

}  // namespace

Verb plan_verb() {
  return {"plan", "shortest safe path on a map's grid; writes path.csv and path.png",
          "lamina plan out/demo/room --from 1,1 --to 2,2", [](CLI::App& app) {
            auto map = std::make_shared<std::string>();
            auto from = std::make_shared<std::string>();
            auto to = std::make_shared<std::string>();
            app.add_option("DIR", *map, "output folder of `map`")->required();
            app.add_option("--from", *from, "X,Y in the map frame, m")->required();
            app.add_option("--to", *to, "X,Y in the map frame, m")->required();
            return [=]() { return plan(*map, point_of(*from, "--from"), point_of(*to, "--to")); };
          }};
}

}  // namespace lamina::apps
