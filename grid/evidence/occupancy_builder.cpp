// Scans at their poses to an occupancy grid, once to tell walls, once without strays.
#include <lamina/grid/evidence/occupancy_builder.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <lamina/grid/evidence/open_sectors.hpp>
#include <lamina/models/ordered_parallel.hpp>

namespace lamina {
namespace {

OccupancyOptions occupancy_options(const GridOptions& grid) {
  OccupancyOptions options;
  options.resolution = grid.resolution;
  options.max_height = std::max(grid.robot.height, 0.1);
  return options;
}

// A level scanner above the robot's own height still tells walls: its band is widened to hold it.
// One that hangs or leans crosses the robot's heights by itself, and may be far above them.
OccupancyOptions with_scanner(OccupancyOptions options, const SE3& T_map_lidar, double under) {
  constexpr double kLevel = 0.94;  // cosine: within 20 degrees
  if (std::abs((T_map_lidar.so3() * Eigen::Vector3d::UnitZ()).z()) < kLevel) return options;
  const double z = T_map_lidar.translation().z() - under;
  options.max_height = std::max(options.max_height, z + 0.1);
  options.min_height = std::min(options.min_height, z - 0.1);
  return options;
}

// Which beams without return clear.
std::vector<char> empty_beams(const LaserScan& scan, bool clear, NoReturn mode) {
  if (clear && mode == NoReturn::kAuto) return open_sectors(scan);
  std::vector<char> empty(scan.size(), 0);
  for (std::size_t i = 0; i < scan.size() && clear; ++i) empty[i] = came_back_empty(scan, i);
  return empty;
}

// A beam that ends on the ground met nothing in the robot's way.
std::vector<OccupancyBeam> beams_of(const LaserScan& scan, const SE3& T_map_lidar,
                                    const GroundHits& ground,
                                    const std::vector<char>& empty_is_free) {
  constexpr double kNear = 0.05;  // m; and a third of the scanner's height
  const double near = std::min(kNear, scan.lidar.T_body_lidar.translation().z() / 3);
  std::vector<OccupancyBeam> beams;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (!scan.valid(i)) {
      if (empty_is_free[i] != 0) {
        const double a = scan.angle(i), r = scan.range_max;
        beams.push_back({{r * std::cos(a), r * std::sin(a)}, 0, false, false});
      }
      continue;
    }
    const Eigen::Vector2d p = scan.point(i);
    const bool grounded =
        !ground.empty() && ground.ends_on(T_map_lidar.translation(),
                                          T_map_lidar * Eigen::Vector3d(p.x(), p.y(), 0), near);
    beams.push_back({p, scan.lidar.noise.range_sigma, !grounded, true});
  }
  return beams;
}

// Scans whose cells all threads work out, taken in their order.
class Batch {
 public:
  explicit Batch(int threads) : scans_(threads), cells_(scans_.threads()) {}

  void add(OccupancyGrid& grid, const SE3& T_map_scan, std::vector<OccupancyBeam> beams,
           double ground, const OccupancyGrid* first_grid) {
    scans_.add({T_map_scan, std::move(beams), ground, first_grid, {}});
    if (scans_.full()) take_into(grid);
  }

  void take_into(OccupancyGrid& grid) {
    scans_.run(
        [&](Scan& s, std::size_t thread) {
          s.touches = grid.touches(s.T_map_scan, s.beams, s.ground, s.first_grid, cells_[thread]);
        },
        [&](const Scan& s) { grid.take(s.touches); });
  }

 private:
  struct Scan {
    SE3 T_map_scan;
    std::vector<OccupancyBeam> beams;
    double ground;
    const OccupancyGrid* first_grid;
    std::vector<CellTouch> touches;
  };
  OrderedBatch<Scan> scans_;
  std::vector<TouchedCells> cells_;  // of each thread
};

}  // namespace

ScanOccupancy occupancy_of_scans(const ForEachScan& for_each_scan, const Trajectory& trajectory,
                                 const GroundHits& ground, const GridOptions& options) {
  const GroundHits none({});
  ScanOccupancy all;
  std::optional<OccupancyGrid> scanners;  // real scans alone, strays and all
  NoReturns no_returns;
  std::map<double, bool> free;  // by range_max: whether empty beams are
  Batch batch(options.threads);
  const auto each = [&](std::optional<OccupancyGrid>& grid, const auto& take) {
    double under = 0;  // the body: map z of its ground, where ramps lead to others
    for_each_scan([&](const KeptScan& kept) {
      const auto pose = trajectory.at(kept.scan.stamp);
      if (!pose) return;
      if (!ground.empty()) under = ground.under(pose->translation()).value_or(under);
      take(kept, *pose * kept.scan.lidar.T_body_lidar, under);
    });
    if (grid) batch.take_into(*grid);
  };
  const auto add = [&](std::optional<OccupancyGrid>& grid, const KeptScan& kept,
                       const SE3& T_map_lidar, double under, const OccupancyGrid* first_grid) {
    if (!grid) grid.emplace(with_scanner(occupancy_options(options), T_map_lidar, under));
    const bool clear = first_grid != nullptr && free[kept.scan.range_max];
    batch.add(*grid, T_map_lidar,
              beams_of(kept.scan, T_map_lidar, kept.from_depth ? none : ground,
                       empty_beams(kept.scan, clear, options.no_return_is_free)),
              under, first_grid);
  };
  each(scanners, [&](const KeptScan& kept, const SE3& T_map_lidar, double under) {
    all.of_images = all.of_images || kept.from_depth;
    if (kept.from_depth) return;
    add(scanners, kept, T_map_lidar, under, nullptr);
    if (options.no_return_is_free != NoReturn::kFalse) no_returns.add(kept.scan, T_map_lidar);
    free.try_emplace(kept.scan.range_max, options.no_return_is_free == NoReturn::kTrue);
  });
  if (options.no_return_is_free == NoReturn::kAuto) {
    for (auto& [range_max, is] : free) is = no_returns.free(range_max, *scanners);
  }
  each(all.grid, [&](const KeptScan& kept, const SE3& T_map_lidar, double under) {
    add(all.grid, kept, T_map_lidar, under, kept.from_depth || !scanners ? nullptr : &*scanners);
    const double height = T_map_lidar.translation().z() - under;
    all.low = std::min(all.low, height);
    all.high = std::max(all.high, height);
  });
  if (scanners || all.grid) all.seen_through = (scanners ? *scanners : *all.grid).seen_through();
  if (all.of_images) all.scanners = std::move(scanners);
  return all;
}

}  // namespace lamina
