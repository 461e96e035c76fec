// Scanner's view to navigability.
#include <lamina/grid/occupancy_fill.hpp>

#include <cmath>

#include <lamina/models/error.hpp>

namespace lamina {

void fill_from_occupancy(NavigabilityGrid& grid, const OccupancyGrid& occupancy,
                         const OccupancyFill& options) {
  LAMINA_CHECK(std::abs(grid.resolution() - occupancy.cells().resolution()) < 1e-9);
  occupancy.cells().for_each([&](const CellIndex& c, const OccupancyCell& seen) {
    if (!seen.seen()) return;
    const auto p = static_cast<double>(occupancy.probability(c));
    const bool blocked = p > options.occupied;
    if (!blocked && p >= options.free) return;
    if (const NavigabilityCell* known = grid.find(c); known != nullptr && known->known()) return;
    NavigabilityCell& cell = grid.at_or_new(c);
    cell.navigability = blocked ? 0.0F : 1.0F;
    cell.confidence = static_cast<float>(blocked ? p : (1 - p) * options.floor_trust);
  });
}

namespace {

bool stands_near(const NavigabilityGrid& grid, const CellIndex& c, int reach) {
  for (int j = c.j - reach; j <= c.j + reach; ++j) {
    for (int i = c.i - reach; i <= c.i + reach; ++i) {
      const NavigabilityCell* cell = grid.find({i, j});
      if (cell != nullptr && cell->navigability == 0) return true;
    }
  }
  return false;
}

// Marks of images alone, with nothing that stands near in the map of the same images.
std::vector<CellIndex> unsupported(const OccupancyGrid& occupancy, const OccupancyGrid* scanners,
                                   const NavigabilityGrid& grid, int reach, double occupied) {
  std::vector<CellIndex> cells;
  occupancy.cells().for_each([&](const CellIndex& c, const OccupancyCell& seen) {
    if (!seen.seen() || static_cast<double>(occupancy.probability(c)) <= occupied) return;
    const bool scanned =
        scanners != nullptr && static_cast<double>(scanners->probability(c)) > occupied;
    if (!scanned && !stands_near(grid, c, reach)) cells.push_back(c);
  });
  return cells;
}

}  // namespace

void agree_with_ground(OccupancyGrid& occupancy, const OccupancyGrid* scanners,
                       const NavigabilityGrid& grid, const OccupancyFill& options) {
  LAMINA_CHECK(std::abs(grid.resolution() - occupancy.cells().resolution()) < 1e-9);
  const auto reach = static_cast<int>(std::lround(options.near / grid.resolution()));
  grid.for_each([&](const CellIndex& c, const NavigabilityCell& cell) {
    if (!(cell.navigability > 0)) return;
    const auto p = static_cast<double>(occupancy.probability(c));
    const bool scanned =
        scanners != nullptr && static_cast<double>(scanners->probability(c)) > options.occupied;
    if (!(p < options.free) && !scanned) occupancy.make_free(c);
  });
  for (const CellIndex& c : unsupported(occupancy, scanners, grid, reach, options.occupied))
    occupancy.forget(c);
}

std::vector<Eigen::Vector3d> without_passed(const std::vector<Eigen::Vector3d>& points_map,
                                            const OccupancyGrid& occupancy, double low, double high,
                                            const OccupancyFill& options,
                                            const GroundBelow& ground) {
  std::vector<Eigen::Vector3d> kept;
  const double r = occupancy.cells().resolution();
  for (const Eigen::Vector3d& p : points_map) {
    const double height = ground ? p.z() - ground(p) : p.z();
    if (height >= low && height <= high && p.allFinite()) {
      const CellIndex c = cell_of(p.head<2>(), r);
      const OccupancyCell* seen = occupancy.cells().find(c);
      const bool passed = seen != nullptr && seen->seen() &&
                          static_cast<double>(occupancy.probability(c)) < options.free;
      if (passed) continue;
    }
    kept.push_back(p);
  }
  return kept;
}

}  // namespace lamina
