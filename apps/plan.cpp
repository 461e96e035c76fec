// `lamina plan`: the shortest safe path on a map's grid.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>

#include <lamina/apps/verbs.hpp>
#include <lamina/models/error.hpp>
#include <lamina/pipeline/config/plan_on_map.hpp>
#include <lamina/pipeline/config/setting.hpp>

namespace lamina::apps {
namespace {

Eigen::Vector2d point_of(const std::string& text, const std::string& option) {
  constexpr double kFurthest = 1e6;  // m: cells beyond have no number
  std::array<double, 2> xy{};
  try {
    text::read("[" + text + "]", xy);
    if (std::max(std::abs(xy[0]), std::abs(xy[1])) <= kFurthest) return {xy[0], xy[1]};
  } catch (const std::invalid_argument&) {
  }
  throw Error(option + ": found '" + text + "', expected X,Y in metres, within 1000 km");
}

int plan(const std::filesystem::path& map, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const Plan plan = plan_on_map(map, from, to);
  if (plan.status != PlanStatus::kFound) {
    std::cerr << "lamina: no path: " << plan.reason << '\n';
    return kFailed;
  }
  for (const Eigen::Vector2d& p : plan.path_map) fmt::print("{:.3f},{:.3f}\n", p.x(), p.y());
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
