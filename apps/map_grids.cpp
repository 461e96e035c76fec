// Grids of a map: where a robot may go, and what scans met.
#include <cmath>
#include <limits>

#include <lamina/apps/ground_hits.hpp>
#include <lamina/apps/leaning_walls.hpp>
#include <lamina/apps/legs.hpp>
#include <lamina/apps/map_output.hpp>
#include <lamina/apps/occupancy_of_scans.hpp>
#include <lamina/apps/overhangs.hpp>
#include <lamina/grid/driven_ground.hpp>
#include <lamina/grid/occupancy_fill.hpp>
#include <lamina/grid/occupancy_grid.hpp>
#include <lamina/grid/rasterizer.hpp>
#include <lamina/io/grid_files.hpp>
#include <lamina/io/terrain_files.hpp>

namespace lamina::apps {
namespace {

RasterOptions raster_options(const Settings& settings) {
  RasterOptions options;
  options.resolution = settings.grid_resolution;
  options.robot_height = settings.robot.height;
  options.max_step = settings.robot.max_step;
  options.max_slope = settings.robot.max_slope;
  return options;
}

// How much of the floor that was seen is free, and how much open because its heights are not known
// to the robot's largest step.
void count_steps(const Rasterizer& rasterizer, io::Metrics& metrics) {
  double free = 0, open = 0;
  rasterizer.grid().for_each([&](const CellIndex& index, const NavigabilityCell& cell) {
    if (cell.navigability > 0) ++free;
    if (std::isnan(cell.navigability) && std::isfinite(cell.height))
      open += rasterizer.doubt(index) == Doubt::kStep;
  });
  metrics.counts["cells_free"] = free;
  metrics.counts["cells_step_open"] = open;
}

std::vector<CellIndex> cells_of(const NavigabilityGrid& grid) {
  std::vector<CellIndex> cells;
  grid.for_each([&](const CellIndex& c, const NavigabilityCell&) { cells.push_back(c); });
  return cells;
}

}  // namespace

void MapOutput::draw_no_ground() { metrics.counts["images_show_no_floor"] = 1; }

bool MapOutput::draws_ground() const { return metrics.counts.count("images_show_no_floor") == 0; }

// A signal ends a stage between two tiles, rows, scans or looks.
void MapOutput::end_if_time_is_up() const {
  constexpr double kForTheRest = 0.3;  // s before the end: path, planes, metrics, report
  if (interrupt_ && interrupt_->out_of_time(kForTheRest)) throw EndedEarly();
}

// Scans of images that show no floor rest on none.
ScanOccupancy MapOutput::occupancy_of(const Trajectory& trajectory,
                                      const GroundHits& ground) const {
  const bool of_images = draws_ground();
  const auto scans = [&](const std::function<void(const io::KeptScan&)>& take) {
    for_each_scan([&](const io::KeptScan& kept) {
      if (of_images || !kept.from_depth) take(kept);
    });
  };
  return occupancy_of_scans(scans, trajectory, ground, settings_);
}

// Loose points without those that scans went through, and with what images saw on the ground.
void MapOutput::settle_points(PlanarMap& map, const Trajectory& trajectory,
                              const GroundHits& ground, const ScanOccupancy& seen) const {
  constexpr double kScanBand = 0.1;  // m about the scanner's height that its rays speak for
  constexpr double kNobodyKnows = std::numeric_limits<double>::quiet_NaN();
  GroundBelow below;
  if (!ground.empty()) {
    below = [&](const Eigen::Vector3d& p) { return ground.under(p).value_or(kNobodyKnows); };
  }
  if (seen.grid) {
    map.loose_points = without_passed(map.loose_points, *seen.grid, seen.low - kScanBand,
                                      seen.high + kScanBand, {}, below);
  }
  if (draws_ground())
    ground_.put_into(map, trajectory, settings_.grid_resolution, settings_.robot.max_step);
}

// What rims and legs hide is unknown, what was driven over is free, whatever else is known.
NavigabilityGrid MapOutput::ground_of(Rasterizer&& rasterizer, const Trajectory& trajectory) const {
  const std::vector<SolidCell> solid = rasterizer.solid_cells();
  const std::vector<CellIndex> behind =
      hidden_behind(solid, sights_.seen(), trajectory, settings_.grid_resolution,
                    [this](const auto& take) { for_each_scan(take); });
  const std::vector<CellIndex> between = between_legs(
      solid, sights_.seen(), trajectory, settings_.grid_resolution, settings_.robot.height);
  DrivenOptions robot;
  robot.radius = settings_.robot.radius;
  const std::vector<DrivenCell> driven = driven_over(rasterizer, trajectory, robot);
  NavigabilityGrid grid = std::move(rasterizer).take_grid();
  hide(grid, behind);
  hide(grid, between);
  free_cells(grid, driven, raster_options(settings_).min_probability);
  if (!draws_ground()) hide(grid, cells_of(grid));
  return grid;
}

void MapOutput::write_grids(const NavigabilityGrid& grid,
                            const std::optional<OccupancyGrid>& occupancy) {
  end_if_time_is_up();
  io::write_grid(folder_ / "grid", grid);
  drawn_.insert("grid");
  end_if_time_is_up();
  io::write_navigability_map(folder_, grid);
  drawn_.insert({"map.yaml", "map.png"});
  end_if_time_is_up();
  io::write_terrain_ply(folder_ / "terrain.ply", grid);
  drawn_.insert("terrain.ply");
  const GridGeometry bounds = occupancy ? occupancy->bounds() : GridGeometry{};
  io::write_occupancy_map(folder_, bounds, [&](int row, float* values) {
    end_if_time_is_up();
    occupancy->image_row(bounds, row, values);
  });
  drawn_.insert({"occupancy.yaml", "occupancy.pgm"});
}

void MapOutput::draw_grids(PlanarMap map, const Trajectory& trajectory) {
  const auto timer = metrics.time("raster");
  if (const std::size_t out = leave_out_leaning(map.planes); out > 0)
    metrics.counts["leaning_walls"] = static_cast<double>(out);
  const GroundHits ground(map.planes);
  ScanOccupancy seen = occupancy_of(trajectory, ground);
  std::optional<OccupancyGrid>& occupancy = seen.grid;
  settle_points(map, trajectory, ground, seen);
  Rasterizer rasterizer(raster_options(settings_));
  rasterizer.before_each_tile([this] { end_if_time_is_up(); });
  rasterizer.update(map);
  if (draws_ground()) count_steps(rasterizer, metrics);
  // Scans alone may make a scrap of a level plane out of clutter: that is no floor.
  const bool floor_seen = draws_ground() && rasterizer.floor_seen() &&
                          (!map.surfels.empty() || rasterizer.floor_under_path());
  NavigabilityGrid grid = ground_of(std::move(rasterizer), trajectory);
  // A map from scans alone: nothing looked at the floor, what is clear at the scanner's height is
  // the best there is, and its confidence says so.
  if (!floor_seen && occupancy) fill_from_occupancy(grid, *occupancy);
  if (floor_seen && seen.of_images)
    agree_with_ground(*occupancy, seen.scanners ? &*seen.scanners : nullptr, grid);
  write_grids(grid, occupancy);
}

}  // namespace lamina::apps
