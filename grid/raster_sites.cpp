// Which floor is the robot's at each cell, and what may be said of it.
#include <algorithm>
#include <cmath>
#include <limits>

#include <lamina/grid/raster_tile.hpp>

namespace lamina::raster {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

// Height of the path at its point nearest to the tile.
float path_height(const std::vector<PathPoint>& path, const RasterOptions& options,
                  const Tile& tile) {
  const Eigen::Vector2d middle =
      center_of({tile.first.i + kSide / 2, tile.first.j + kSide / 2}, options.resolution);
  double nearest = std::numeric_limits<double>::infinity();
  float height = kNaN;
  for (const std::int32_t k : tile.references) {
    const Eigen::Vector3d& p = path[static_cast<std::size_t>(k)].position_map;
    const double d = (p.head<2>() - middle).squaredNorm();
    if (d < nearest) {
      nearest = d;
      height = static_cast<float>(p.z());
    }
  }
  return height;
}

// References of cells with no connected floor: that of the nearest cell of the tile that has one.
void spread_references(const std::vector<std::int32_t>& sources, Tile& tile) {
  std::vector<std::int32_t> open = sources;
  for (std::size_t k = 0; k < open.size(); ++k) {
    const int cell = open[k], i = cell % kSide, j = cell / kSide;
    const float reference = tile.sites[static_cast<std::size_t>(cell)].reference;
    const auto visit = [&](int u, int v) {
      if (u < 0 || v < 0 || u >= kSide || v >= kSide) return;
      Site& site = tile.sites[static_cast<std::size_t>(cell_in(u, v))];
      if (site.reference == site.reference) return;
      site.reference = reference;
      open.push_back(cell_in(u, v));
    };
    visit(i - 1, j), visit(i + 1, j), visit(i, j - 1), visit(i, j + 1);
  }
}

void take(const Level& level, bool reached, Site& site) {
  const Support& s = level.surface;
  site.height = site.top = s.height;
  site.variance = s.variance;
  site.slope_x = s.slope_x;
  site.slope_y = s.slope_y;
  site.tilt_variance = s.tilt_variance;
  site.source = s.source;
  site.trend = s.trend;
  site.supported = true;
  site.reached = reached;
  site.met = !reached && s.reach == Support::kMetReach;
  if (reached) site.reference = s.height;
}

// Not connected: the level nearest to the floor around. A plane's fill alone does not count: its
// outline covers what it surrounds, and inside a rim there may be a hole.
void take_nearest(std::span<const Level> levels, Site& site) {
  const Level* best = nullptr;
  for (const Level& level : levels) {
    if (level.surface.from_plane()) continue;
    if (best == nullptr || std::abs(level.surface.height - site.reference) <
                               std::abs(best->surface.height - site.reference)) {
      best = &level;
    }
  }
  if (best != nullptr) take(*best, false, site);
}

// Does it stand in the robot's way?
bool in_the_way(float low, float high, float base, const RasterOptions& options) {
  return high > base + static_cast<float>(options.max_step) &&
         low < base + static_cast<float>(options.robot_height);
}

bool touch(float low, float high, float base, const RasterOptions& options, Site& site) {
  if (!in_the_way(low, high, base, options)) return false;
  site.blocked = true;
  site.top = std::max(site.top, std::min(high, base + static_cast<float>(options.robot_height)));
  return true;
}

}  // namespace

void choose_sites(const std::vector<PathPoint>& path, float fallback, const RasterOptions& options,
                  Tile& tile) {
  tile.sites.assign(kCells, Site{});
  std::vector<std::int32_t> sources;
  sources.reserve(kCells);
  for (int cell = 0; cell < kCells; ++cell) {
    Site& site = tile.sites[static_cast<std::size_t>(cell)];
    site.reference = kNaN;
    site.flags = tile.flags[static_cast<std::size_t>(cell)];
    for (const Level& level : tile.levels_at(cell)) {
      if (!tile.reached[static_cast<std::size_t>(level.component)]) continue;
      take(level, true, site);  // of two floors in reach over each other the lower
      sources.push_back(cell);
      break;
    }
  }
  if (sources.empty()) {
    const bool carried = fallback == fallback;
    const float reference = carried ? fallback : path_height(path, options, tile);
    for (Site& site : tile.sites) {
      site.reference = reference;
      site.from_afar = carried;
    }
  } else if (sources.size() < tile.sites.size()) {
    spread_references(sources, tile);
  }
  auto obstacle = tile.obstacles.begin();
  for (int cell = 0; cell < kCells; ++cell) {
    Site& site = tile.sites[static_cast<std::size_t>(cell)];
    if (site.reference == site.reference && !site.supported) {
      take_nearest(tile.levels_at(cell), site);
    }
    const float base = site.supported ? site.height : site.reference;
    if (!site.supported) site.top = -std::numeric_limits<float>::infinity();
    for (const Level& level : tile.levels_at(cell)) {
      const bool alone = level.surface.from_plane() && !site.supported;
      if (!alone && touch(level.surface.height, level.surface.height, base, options, site)) {
        site.surface_above = true;
      }
    }
    for (; obstacle != tile.obstacles.end() && obstacle->cell == cell; ++obstacle) {
      touch(obstacle->low, obstacle->high, base, options, site);
    }
  }
}

float lowest_solid(const Tile& tile, int cell, float base, const RasterOptions& options) {
  float lowest = std::numeric_limits<float>::infinity();
  const auto take = [&](float low, float high) {
    if (in_the_way(low, high, base, options)) lowest = std::min(lowest, low);
  };
  for (const Level& level : tile.levels_at(cell)) take(level.surface.height, level.surface.height);
  auto obstacle = std::lower_bound(tile.obstacles.begin(), tile.obstacles.end(), cell,
                                   [](const Obstacle& o, int c) { return o.cell < c; });
  for (; obstacle != tile.obstacles.end() && obstacle->cell == cell; ++obstacle) {
    take(obstacle->low, obstacle->high);
  }
  return lowest;
}

void choose_again(const std::vector<PathPoint>& path, float fallback, const RasterOptions& options,
                  Tile& tile) {
  const std::vector<Site> old = std::move(tile.sites);
  tile.sites.clear();
  if (tile.has_evidence() && tile.says_anything()) choose_sites(path, fallback, options, tile);
  tile.changed = {};
  // No site is as good as one that says nothing.
  const auto nothing = [](const Site& s) { return !s.supported && !s.blocked && s.flags == 0; };
  for (int cell = 0; cell < kCells; ++cell) {
    const auto c = static_cast<std::size_t>(cell);
    const bool stays = old.empty()          ? tile.sites.empty() || nothing(tile.sites[c])
                       : tile.sites.empty() ? nothing(old[c])
                                            : tile.sites[c].chosen_as(old[c]);
    if (!stays) {
      tile.changed.set(cell);
    } else if (!old.empty() && !tile.sites.empty()) {
      tile.sites[c] = old[c];
    }
  }
}

}  // namespace lamina::raster
