// Evidence of all looks, then one grid after the other.
#include <lamina/pipeline/build_grid.hpp>

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include <lamina/backend/consistency/leaning_walls.hpp>
#include <lamina/grid/driven_ground.hpp>
#include <lamina/grid/evidence/ground_surfaces.hpp>
#include <lamina/grid/evidence/legs.hpp>
#include <lamina/grid/evidence/occupancy_builder.hpp>
#include <lamina/grid/evidence/overhangs.hpp>
#include <lamina/grid/occupancy_fill.hpp>
#include <lamina/grid/occupancy_grid.hpp>
#include <lamina/grid/rasterizer.hpp>

namespace lamina {
namespace {

RasterOptions raster_options(const GridOptions& settings) {
  RasterOptions options;
  options.resolution = settings.resolution;
  options.robot_height = settings.robot.height;
  options.max_step = settings.robot.max_step;
  options.max_slope = settings.robot.max_slope;
  return options;
}

// How much of the floor that was seen is free, and how much open because its heights are not known
// to the robot's largest step.
void count_steps(const Rasterizer& rasterizer, Diagnostics& metrics) {
  double free = 0, open = 0;
  rasterizer.grid().for_each([&](const CellIndex& index, const NavigabilityCell& cell) {
    if (cell.navigability > 0) ++free;
    if (std::isnan(cell.navigability) && std::isfinite(cell.height))
      open += rasterizer.unknown_cause(index) == UnknownCause::kStep;
  });
  metrics.counts.cells_free = free;
  metrics.counts.cells_step_open = open;
}

// Of real buildings, people and glass and all, 11 to 16 % of the marks.
void warn_of_contradiction(const ScanOccupancy& seen, Diagnostics& metrics) {
  const double usual = 0.25;
  if (seen.seen_through <= usual) return;
  metrics.warn("scans_contradicted",
               fmt::format("{:.0f} % of what scans marked lies where more beams went on behind "
                           "(usual: 16 at most): noise, things that moved, or a sensor whose "
                           "ranges, mounting or view changed on the way; cells of the grid are "
                           "wrong in part",
                           100 * seen.seen_through));
}

std::vector<CellIndex> cells_of(const NavigabilityGrid& grid) {
  std::vector<CellIndex> cells;
  grid.for_each([&](const CellIndex& c, const NavigabilityCell&) { cells.push_back(c); });
  return cells;
}

// One map's grids, while they are drawn.
class GridBuilder {
 public:
  GridBuilder(RunRecord& record, const Trajectory& trajectory, const GridOptions& options,
              const RunObserver& observer)
      : record_(record), trajectory_(trajectory), options_(options), observer_(observer) {}

  Grids draw(PlanarMap map);

 private:
  bool draws_ground() const { return !record_.diagnostics.counts.images_show_no_floor.known(); }
  void end_if_time_is_up() const { require_time(observer_); }
  ScanOccupancy occupancy_of(const GroundHits& ground) const;
  void settle_points(PlanarMap& map, const GroundHits& ground, const ScanOccupancy& seen) const;
  NavigabilityGrid ground_of(Rasterizer&& rasterizer) const;

  RunRecord& record_;
  const Trajectory& trajectory_;
  const GridOptions& options_;
  const RunObserver& observer_;
};

// Scans of images that show no floor rest on none.
ScanOccupancy GridBuilder::occupancy_of(const GroundHits& ground) const {
  const bool of_images = draws_ground();
  const auto scans = [&](const std::function<void(const KeptScan&)>& take) {
    record_.for_each_scan([&](const KeptScan& kept) {
      if (of_images || !kept.from_depth) take(kept);
    });
  };
  return occupancy_of_scans(scans, trajectory_, ground, options_);
}

// Loose points without those that scans went through, and with what images saw on the ground.
void GridBuilder::settle_points(PlanarMap& map, const GroundHits& ground,
                                const ScanOccupancy& seen) const {
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
    record_.ground.put_into(map, trajectory_, options_.resolution, options_.robot.max_step);
}

// What rims and legs hide is unknown, what was driven over is free, whatever else is known.
NavigabilityGrid GridBuilder::ground_of(Rasterizer&& rasterizer) const {
  const std::vector<SolidCell> solid = rasterizer.solid_cells();
  const std::vector<CellIndex> behind =
      hidden_behind(solid, record_.sights.seen(), trajectory_, options_.resolution,
                    [this](const auto& take) { record_.for_each_scan(take); });
  const std::vector<CellIndex> between = between_legs(solid, record_.sights.seen(), trajectory_,
                                                      options_.resolution, options_.robot.height);
  DrivenOptions robot;
  robot.radius = options_.robot.radius;
  const std::vector<DrivenCell> driven = driven_over(rasterizer, trajectory_, robot);
  NavigabilityGrid grid = std::move(rasterizer).take_grid();
  hide(grid, behind);
  hide(grid, between);
  free_cells(grid, driven, raster_options(options_).min_probability);
  if (!draws_ground()) hide(grid, cells_of(grid));
  return grid;
}

Grids GridBuilder::draw(PlanarMap map) {
  if (const std::size_t out = leave_out_leaning(map.planes); out > 0)
    record_.diagnostics.counts.leaning_walls = static_cast<double>(out);
  const GroundHits ground(map.planes);
  ScanOccupancy seen = occupancy_of(ground);
  std::optional<OccupancyGrid>& occupancy = seen.grid;
  warn_of_contradiction(seen, record_.diagnostics);
  settle_points(map, ground, seen);
  Rasterizer rasterizer(raster_options(options_));
  rasterizer.before_each_tile([this] { end_if_time_is_up(); });
  rasterizer.update(map);
  if (draws_ground()) count_steps(rasterizer, record_.diagnostics);
  // Scans alone may make a scrap of a level plane out of clutter: that is no floor.
  const bool floor_seen = draws_ground() && rasterizer.floor_seen() &&
                          (!map.surfels.empty() || rasterizer.floor_under_path());
  NavigabilityGrid grid = ground_of(std::move(rasterizer));
  // A map from scans alone: nothing looked at the floor, what is clear at the scanner's height is
  // the best there is, and its confidence says so.
  if (!floor_seen && occupancy) fill_from_occupancy(grid, *occupancy);
  if (floor_seen && seen.of_images)
    agree_with_ground(*occupancy, seen.scanners ? &*seen.scanners : nullptr, grid);
  return {std::move(grid), std::move(occupancy)};
}

}  // namespace

void require_time(const RunObserver& observer) {
  constexpr double kForTheRest = 0.3;  // s before the end: path, planes, metrics, report
  if (observer.seconds_left() < kForTheRest) throw EndedEarly();
}

void add_evidence(PlanarMap& map, RunRecord& record, const Trajectory& trajectory,
                  const GridOptions& options) {
  const std::vector<EdgePoint> rims = record.rims.rims(trajectory, options.resolution);
  map.edges.insert(map.edges.end(), rims.begin(), rims.end());
  const auto timer = record.diagnostics.time("sights");
  record.sights.withdraw(
      map, trajectory, options.resolution,
      [&record](const auto& take) { record.for_each_scan(take); }, options.threads);
}

Grids build_grids(const PlanarMap& map, RunRecord& record, const Trajectory& trajectory,
                  const GridOptions& options, const RunObserver& observer) {
  const auto timer = record.diagnostics.time("raster");
  return GridBuilder(record, trajectory, options, observer).draw(map);
}

}  // namespace lamina
