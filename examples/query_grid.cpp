// Asks a map's grid what is at a place, and for a path between two.
#include <cstdio>
#include <cstdlib>

#include <lamina/grid/planner.hpp>
#include <lamina/io/grid_files.hpp>

int main(int argc, char** argv) try {
  if (argc != 6) return std::fputs("usage: query_grid FOLDER X0 Y0 X1 Y1\n", stderr), 2;
  const std::filesystem::path folder = argv[1];
  const lamina::NavigabilityGrid grid = lamina::io::read_grid(folder / "grid").grid;
  const Eigen::Vector2d from(std::atof(argv[2]), std::atof(argv[3]));
  const Eigen::Vector2d to(std::atof(argv[4]), std::atof(argv[5]));
  if (const auto* cell = grid.find(lamina::cell_of(from, grid.resolution())))
    std::printf("start: navigability %.2f, height %.3f m\n",
                static_cast<double>(cell->navigability), static_cast<double>(cell->height));
  const lamina::Plan plan = lamina::plan_path(grid, from, to);
  if (plan.status != lamina::PlanStatus::kFound)
    return std::printf("no path: %s\n", plan.reason.c_str()), 0;
  std::printf("path of %.2f m over %zu waypoints\n", plan.length, plan.path_map.size());
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 2;
}
