// Rays over cells, and what they say of them.
#include <lamina/grid/occupancy_grid.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace lamina {
namespace {

// The part of a ray inside the height band, as [first, last] in units of its length; empty when
// first > last.
std::pair<double, double> in_band(double z_from, double z_to, double low, double high) {
  double first = 0, last = 1;
  const double rise = z_to - z_from;
  if (std::abs(rise) < 1e-12) {
    return z_from >= low && z_from <= high ? std::pair{0.0, 1.0} : std::pair{1.0, 0.0};
  }
  const double a = (low - z_from) / rise, b = (high - z_from) / rise;
  first = std::max(first, std::min(a, b));
  last = std::min(last, std::max(a, b));
  return {first, last};
}

// Strays come one by one: a beam whose neighbour in the scan ends near it met something.
bool ends_beside_another(const std::vector<OccupancyBeam>& beams, std::size_t k) {
  constexpr double kNear = 0.3, kShare = 0.1;  // m; of the range: the steps of a grazed wall
  const Eigen::Vector2d& end = beams[k].end_scan;
  const double near = std::max(kNear, kShare * end.norm());
  const std::size_t n = beams.size();
  for (const std::size_t other : {(k + n - 1) % n, (k + 1) % n}) {
    if (other != k && (beams[other].end_scan - end).norm() <= near) return true;
  }
  return false;
}

bool is_solid(const OccupancyCell* cell) {
  constexpr int kEnds = 4;
  constexpr float kOccupied = 0.62F;  // log-odds of 0.65, map_server's threshold
  return cell != nullptr && cell->log_odds > kOccupied && cell->ends >= kEnds &&
         cell->ends >= 2 * cell->passes;
}

// The cell or one of the eight about it.
template <class Is>
bool any_about(const CellIndex& c, Is&& is) {
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) {
      if (is(CellIndex{c.i + i, c.j + j})) return true;
    }
  }
  return false;
}

float probability_of(const OccupancyCell& cell) { return 1.0F / (1.0F + std::exp(-cell.log_odds)); }

void count(std::uint16_t& n) {
  if (n < std::numeric_limits<std::uint16_t>::max()) ++n;
}

}  // namespace

std::vector<std::string> OccupancyOptions::problems() const {
  std::vector<std::string> lines;
  if (!(resolution >= 0.001)) lines.push_back("occupancy resolution must be at least 0.001 m");
  if (!(log_odds_hit > 0) || !(log_odds_miss > 0)) {
    lines.push_back("occupancy log-odds must be above 0");
  }
  if (!(log_odds_limit >= log_odds_hit)) {
    lines.push_back("occupancy limit must be at least one hit");
  }
  if (!(max_height > min_height)) lines.push_back("occupancy height band must not be empty");
  return lines;
}

OccupancyGrid::OccupancyGrid(const OccupancyOptions& options)
    : options_(options), cells_(options.resolution) {}

// Amanatides & Woo [Amanatides1987]: every cell the line touches, in order.
void OccupancyGrid::trace(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                          std::vector<CellIndex>& crossed) const {
  const double size = options_.resolution;
  CellIndex cell = cell_of(from, size);
  const CellIndex end = cell_of(to, size);
  const Eigen::Vector2d d = to - from;
  double next[2], step_length[2];
  int step[2];
  const std::int32_t index[2] = {cell.i, cell.j};
  for (int axis = 0; axis < 2; ++axis) {
    step[axis] = d(axis) > 0 ? 1 : -1;
    if (d(axis) == 0) {
      next[axis] = step_length[axis] = std::numeric_limits<double>::infinity();
      continue;
    }
    const double border = (index[axis] + (step[axis] > 0 ? 1 : 0)) * size;
    next[axis] = (border - from(axis)) / d(axis);
    step_length[axis] = size / std::abs(d(axis));
  }
  const int steps = std::abs(end.i - cell.i) + std::abs(end.j - cell.j);
  crossed.push_back(cell);
  for (int k = 0; k < steps; ++k) {
    if (next[0] < next[1]) {
      cell.i += step[0];
      next[0] += step_length[0];
    } else {
      cell.j += step[1];
      next[1] += step_length[1];
    }
    crossed.push_back(cell);
  }
}

// How many of a ray's cells it went on behind.
std::size_t OccupancyGrid::went_on_behind(const std::vector<CellIndex>& ray,
                                          const Eigen::Vector2d& end) const {
  constexpr double kBehind = 0.3;  // m: noise and what is beside a corner end nearer
  const double size = options_.resolution;
  std::size_t n = ray.size();
  while (n > 0) {
    const Eigen::Vector2d centre(size * (ray[n - 1].i + 0.5), size * (ray[n - 1].j + 0.5));
    if ((end - centre).norm() > kBehind) break;
    --n;
  }
  return n;
}

void OccupancyGrid::add(const SE3& T_map_scan, const std::vector<OccupancyBeam>& beams,
                        double ground, const OccupancyGrid* first_grid) {
  take(touches(T_map_scan, beams, ground, first_grid, touched_));
}

std::vector<CellTouch> OccupancyGrid::touches(const SE3& T_map_scan,
                                              const std::vector<OccupancyBeam>& beams,
                                              double ground, const OccupancyGrid* first_grid,
                                              TouchedCells& cells) const {
  const Eigen::Vector3d start = T_map_scan.translation();
  cells.begin(start.head<2>(), reach(beams), options_.resolution);
  std::optional<TiledGrid<OccupancyCell>::Look> first_look;
  if (first_grid) first_look.emplace(first_grid->cells_);
  const auto solid_there = [&](const CellIndex& c) { return is_solid(first_look->find(c)); };
  std::vector<CellIndex> ray;
  for (std::size_t k = 0; k < beams.size(); ++k) {
    const OccupancyBeam& beam = beams[k];
    const double range = beam.end_scan.norm();
    if (!(range > 0) || !std::isfinite(range)) continue;
    const Eigen::Vector3d end =
        T_map_scan * Eigen::Vector3d(beam.end_scan.x(), beam.end_scan.y(), 0);
    const auto [first, last] =
        in_band(start.z(), end.z(), ground + options_.min_height, ground + options_.max_height);
    const CellIndex end_cell = cell_of(end.head<2>(), options_.resolution);
    bool marks = beam.obstacle && last >= 1.0 && range <= options_.max_range;
    const double margin = beam.obstacle ? 3 * beam.sigma / range : 0.0;
    const double clear_to = std::min({last, 1.0 - margin, options_.max_range / range});
    const Eigen::Vector2d d = (end - start).head<2>();
    if (first < clear_to) {
      ray.clear();
      trace(start.head<2>() + first * d, start.head<2>() + clear_to * d, ray);
      const auto behind =
          ray.begin() + static_cast<std::ptrdiff_t>(went_on_behind(ray, end.head<2>()));
      // Of few beams alone: a cell is looked up for each that the ray passed.
      const bool may_stray =
          first_grid != nullptr && (!beam.returned || !ends_beside_another(beams, k));
      const auto wall = may_stray ? std::find_if(ray.begin(), behind, solid_there) : behind;
      for (auto c = ray.begin(); c != wall; ++c) cells.touch(*c, Touch::kPassed);
      if (wall != behind) {
        marks = marks && any_about(end_cell, solid_there);
      } else {
        for (auto c = behind; c != ray.end(); ++c) cells.touch(*c, Touch::kCrossed);
      }
    }
    if (marks) cells.touch(end_cell, Touch::kMarked);
  }
  return cells.all();
}

void OccupancyGrid::take(const std::vector<CellTouch>& touches) {
  const auto limit = static_cast<float>(options_.log_odds_limit);
  for (const auto& [at, touch] : touches) {
    const bool marked = touch == Touch::kMarked;
    const double change = marked ? options_.log_odds_hit : -options_.log_odds_miss;
    OccupancyCell& cell = cells_.at_or_new(at);
    const float before = cell.seen() ? cell.log_odds : 0.0F;
    cell.log_odds = std::clamp(before + static_cast<float>(change), -limit, limit);
    if (marked) count(cell.ends);
    if (touch == Touch::kPassed) count(cell.passes);
  }
}

// m that a scan's cells may be from the scanner.
double OccupancyGrid::reach(const std::vector<OccupancyBeam>& beams) const {
  double square = 0;
  for (const OccupancyBeam& beam : beams) {
    const double s = beam.end_scan.squaredNorm();
    if (std::isfinite(s)) square = std::max(square, s);
  }
  return std::min(std::sqrt(square), options_.max_range);
}

bool OccupancyGrid::solid(const CellIndex& c) const { return is_solid(cells_.find(c)); }

double OccupancyGrid::seen_through() const {
  double all = 0, through = 0;
  cells_.for_each([&](const CellIndex&, const OccupancyCell& cell) {
    all += cell.ends;
    if (cell.passes > cell.ends) through += cell.ends;
  });
  return all > 0 ? through / all : 0;
}

bool OccupancyGrid::solid_between(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const {
  std::vector<CellIndex> ray;
  trace(from, to, ray);
  return std::any_of(ray.begin(), ray.end(), [this](const CellIndex& c) { return solid(c); });
}

void OccupancyGrid::make_free(const CellIndex& c) {
  OccupancyCell& cell = cells_.at_or_new(c);
  cell.log_odds = -static_cast<float>(options_.log_odds_limit);
}

void OccupancyGrid::forget(const CellIndex& c) {
  if (OccupancyCell* cell = cells_.find(c)) *cell = {};
}

float OccupancyGrid::probability(const CellIndex& c) const {
  const OccupancyCell* cell = cells_.find(c);
  if (cell == nullptr || !cell->seen()) return std::numeric_limits<float>::quiet_NaN();
  return probability_of(*cell);
}

GridGeometry OccupancyGrid::bounds() const {
  return cells_.bounds([](const OccupancyCell& cell) { return cell.seen(); });
}

void OccupancyGrid::image_row(const GridGeometry& geometry, int row, float* out) const {
  std::fill_n(out, geometry.width, std::numeric_limits<float>::quiet_NaN());
  const std::int32_t j = geometry.first.j + geometry.height - 1 - row;
  cells_.for_each_in_row(j, [&](const CellIndex& first, const OccupancyCell* cells) {
    const std::int32_t from = std::max(0, geometry.first.i - first.i);
    const std::int32_t to =
        std::min(TiledGrid<OccupancyCell>::kTile, geometry.first.i + geometry.width - first.i);
    for (std::int32_t k = from; k < to; ++k) {
      if (cells[k].seen()) out[first.i + k - geometry.first.i] = probability_of(cells[k]);
    }
  });
}

}  // namespace lamina
