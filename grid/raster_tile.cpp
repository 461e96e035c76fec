// Evidence of a tile to levels, obstacles and components.
#include <lamina/grid/raster_tile.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <lamina/grid/raster_shapes.hpp>

namespace lamina::raster {
namespace {

constexpr float kMergeGap = 0.05F;    // m: obstacles this close above each other are one
constexpr double kSeedSpacing = 0.2;  // m, between places looked at around the path

bool consistent(const Support& a, const Support& b) {
  const float d = a.height - b.height;
  return d * d <= kSignificant * kSignificant * (a.variance + b.variance);
}

// What is said by supports of one level: by discs over the place, else the nearest disc, else
// planes. The highest counts, with those that agree with it. Their errors may be shared (one pose
// carries many), so that agreement does not make the variance smaller than the best one's.
Support combine(std::span<const Support> level) {
  const auto is_core = [](const Support& s) { return s.reach <= 1.0F; };
  const Support* nearest = level.data();
  for (const Support& s : level) {
    if (s.reach < nearest->reach) nearest = &s;
  }
  if (!is_core(*nearest) && !nearest->from_plane()) return *nearest;
  const bool discs = is_core(*nearest);
  const Support* top = nullptr;  // levels ascend: the last is the highest
  for (const Support& s : level) {
    if (!discs || is_core(s)) top = &s;
  }
  Support result = *top;
  double weight = 0, height = 0;
  for (const Support& s : level) {
    if ((discs && !is_core(s)) || !consistent(s, *top)) continue;
    const double w = 1.0 / std::max(static_cast<double>(s.variance), 1e-10);
    weight += w;
    height += w * static_cast<double>(s.height - top->height);
    if (s.variance < result.variance) {
      const float keep = result.height;
      result = s;
      result.height = keep;
    }
  }
  result.height = static_cast<float>(static_cast<double>(top->height) + height / weight);
  return result;
}

// By cell, then height, then source: first into the cells, then the few of each.
void sort_supports(std::vector<Support>& supports) {
  std::array<std::uint32_t, kCells + 1> first{};
  for (const Support& s : supports) ++first[static_cast<std::size_t>(s.cell) + 1];
  for (std::size_t c = 0; c < kCells; ++c) first[c + 1] += first[c];
  std::vector<Support> sorted(supports.size());
  std::array<std::uint32_t, kCells + 1> next = first;
  for (const Support& s : supports) sorted[next[static_cast<std::size_t>(s.cell)]++] = s;
  for (std::size_t c = 0; c < kCells; ++c) {
    std::sort(sorted.begin() + first[c], sorted.begin() + first[c + 1],
              [](const Support& a, const Support& b) {
                return a.height != b.height ? a.height < b.height : a.source < b.source;
              });
  }
  supports.swap(sorted);
}

void make_levels(std::vector<Support>& supports, double gap, Tile& tile) {
  sort_supports(supports);
  tile.levels.clear();
  std::size_t k = 0;
  for (int cell = 0; cell < kCells; ++cell) {
    tile.level_of[static_cast<std::size_t>(cell)] = static_cast<std::uint16_t>(tile.levels.size());
    while (k < supports.size() && supports[k].cell == cell) {
      std::size_t end = k + 1;
      while (end < supports.size() && supports[end].cell == cell &&
             supports[end].height - supports[end - 1].height <= static_cast<float>(gap)) {
        ++end;
      }
      // 16 bits count the levels of a tile: 63 floors over each other everywhere.
      if (tile.levels.size() < 65000) {
        tile.levels.push_back({combine(std::span(supports).subspan(k, end - k)), 0});
      }
      k = end;
    }
  }
  tile.level_of[kCells] = static_cast<std::uint16_t>(tile.levels.size());
}

void merge_obstacles(std::vector<Obstacle>& obstacles) {
  std::sort(obstacles.begin(), obstacles.end(), [](const Obstacle& a, const Obstacle& b) {
    if (a.cell != b.cell) return a.cell < b.cell;
    if (a.low != b.low) return a.low < b.low;
    return a.high < b.high;
  });
  std::size_t kept = 0;
  for (const Obstacle& o : obstacles) {
    if (kept > 0 && obstacles[kept - 1].cell == o.cell &&
        o.low <= obstacles[kept - 1].high + kMergeGap) {
      obstacles[kept - 1].high = std::max(obstacles[kept - 1].high, o.high);
    } else {
      obstacles[kept++] = o;
    }
  }
  obstacles.resize(kept);
}

// A single loose point is noise; two within neighbouring cells are something.
std::vector<Obstacle> points_of(const PlanarMap& map, const RasterOptions& options,
                                const Tile& tile) {
  std::vector<Obstacle> points;
  constexpr int kWide = kSide + 2;
  std::array<std::uint8_t, static_cast<std::size_t>(kWide) * kWide> count{};
  const auto place = [&](const Eigen::Vector3d& p) {
    const CellIndex c = cell_of(p.head<2>(), options.resolution);
    return Eigen::Vector2i(c.i - tile.first.i + 1, c.j - tile.first.j + 1);
  };
  for (const std::int32_t k : tile.points) {
    const Eigen::Vector2i c = place(map.loose_points[static_cast<std::size_t>(k)]);
    if (c.minCoeff() < 0 || c.maxCoeff() >= kWide) continue;
    auto& n = count[static_cast<std::size_t>(c.y() * kWide + c.x())];
    n = static_cast<std::uint8_t>(std::min(n + 1, 2));
  }
  for (const std::int32_t k : tile.points) {
    const Eigen::Vector3d& p = map.loose_points[static_cast<std::size_t>(k)];
    const Eigen::Vector2i c = place(p);
    if (c.minCoeff() < 1 || c.maxCoeff() > kSide) continue;
    int near = 0;
    for (int j = c.y() - 1; j <= c.y() + 1; ++j) {
      for (int i = c.x() - 1; i <= c.x() + 1; ++i) {
        near += count[static_cast<std::size_t>(j * kWide + i)];
      }
    }
    if (near < 2) continue;
    const auto z = static_cast<float>(p.z());
    points.push_back({cell_in(c.x() - 1, c.y() - 1), z, z});
  }
  std::sort(points.begin(), points.end(),
            [](const Obstacle& a, const Obstacle& b) { return a.cell < b.cell; });
  return points;
}

void draw_edge(const EdgePoint& edge, const RasterOptions& options, Tile& tile) {
  const double r = options.resolution, reach = std::max(edge.sigma, 0.75 * r);
  const Eigen::Vector2d middle = edge.position_map.head<2>();
  const CellIndex low = cell_of(middle.array() - reach, r),
                  high = cell_of(middle.array() + reach, r);
  for (int j = std::max(low.j - tile.first.j, 0); j <= std::min(high.j - tile.first.j, kSide - 1);
       ++j) {
    for (int i = std::max(low.i - tile.first.i, 0); i <= std::min(high.i - tile.first.i, kSide - 1);
         ++i) {
      const Eigen::Vector2d c = center_of({tile.first.i + i, tile.first.j + j}, r);
      if ((c - middle).norm() > reach) continue;
      tile.flags[static_cast<std::size_t>(cell_in(i, j))] |= edge.negative ? kRim : kKnowledgeEnd;
    }
  }
}

void join_cells(int a, int b, const RasterOptions& options, const Tile& tile, Components& all) {
  if (tile.cut(a) || tile.cut(b)) return;
  for (int k = tile.level_of[static_cast<std::size_t>(a)];
       k < tile.level_of[static_cast<std::size_t>(a) + 1]; ++k) {
    for (int m = tile.level_of[static_cast<std::size_t>(b)];
         m < tile.level_of[static_cast<std::size_t>(b) + 1]; ++m) {
      if (connects(tile.levels[static_cast<std::size_t>(k)],
                   tile.levels[static_cast<std::size_t>(m)], options)) {
        all.join(k, m);
      }
    }
  }
}

void draw(const PlanarMap& map, const SurfelCounts& surfels_of, const RasterOptions& options,
          BandsOfPlanes& bands, Tile& tile) {
  tile.flags.fill(0);
  tile.obstacles.clear();
  Canvas canvas{tile, options, DiscDistance(options.resolution, options.plane_ring), {}, {},
                {},   {}};
  canvas.points = points_of(map, options, tile);
  for (const std::int32_t k : tile.planes) {
    const MapPlane& plane = map.planes[static_cast<std::size_t>(k)];
    if (!is_steep(plane)) canvas.trends.add(plane);
  }
  for (const std::int32_t k : tile.surfels) {
    const Surfel& surfel = map.surfels[static_cast<std::size_t>(k)];
    draw_disc(surfel, k, canvas);
    if (surfel.parent_plane >= 0) canvas.offsets.add(surfel);
  }
  canvas.offsets.sort();
  canvas.discs.sharpen(options);
  settle_points(canvas);
  bool floors = false;
  for (const std::int32_t k : tile.planes) {
    const MapPlane& plane = map.planes[static_cast<std::size_t>(k)];
    floors = floors || plane.plane_map.normal().z() >= kSteepCosine;
    if (is_steep(plane)) draw_walls(plane, canvas);
  }
  if (!tile.surfels.empty() && floors) {
    canvas.discs.spread(static_cast<float>(options.max_step),
                        static_cast<float>(options.robot_height));
  }
  for (const std::int32_t k : tile.planes) {
    const MapPlane& plane = map.planes[static_cast<std::size_t>(k)];
    if (!is_steep(plane))
      draw_floor(plane, k, surfels_of.contains(plane.id), bands.of(k, plane), canvas);
  }
  tile.obstacles.insert(tile.obstacles.end(), canvas.points.begin(), canvas.points.end());
  for (const std::int32_t k : tile.edges) {
    draw_edge(map.edges[static_cast<std::size_t>(k)], options, tile);
  }
  make_levels(canvas.supports, options.level_gap, tile);
  sharpen_levels(canvas);
  merge_obstacles(tile.obstacles);
}

void label_components(const RasterOptions& options, Tile& tile) {
  Components all(tile.levels.size());
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      if (i + 1 < kSide) join_cells(cell_in(i, j), cell_in(i + 1, j), options, tile, all);
      if (j + 1 < kSide) join_cells(cell_in(i, j), cell_in(i, j + 1), options, tile, all);
    }
  }
  // Roots come before their members: one pass numbers them.
  tile.components = 0;
  for (std::size_t k = 0; k < tile.levels.size(); ++k) {
    const std::int32_t root = all.root(static_cast<std::int32_t>(k));
    if (static_cast<std::size_t>(root) == k) {
      tile.levels[k].component = tile.components++;
    } else {
      tile.levels[k].component = tile.levels[static_cast<std::size_t>(root)].component;
    }
  }
}

// Bit for bit.
template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}
static_assert(sizeof(Level) == 10 * 4 && sizeof(Obstacle) == 3 * 4);  // no gaps

}  // namespace

bool draw_evidence(const PlanarMap& map, const SurfelCounts& surfels_of,
                   const RasterOptions& options, BandsOfPlanes& bands, Tile& tile) {
  const auto flags = tile.flags;
  const auto level_of = tile.level_of;
  const std::vector<Level> levels = std::move(tile.levels);
  const std::vector<Obstacle> obstacles = std::move(tile.obstacles);
  draw(map, surfels_of, options, bands, tile);
  label_components(options, tile);
  return !(flags == tile.flags && level_of == tile.level_of && same(levels, tile.levels) &&
           same(obstacles, tile.obstacles));
}

bool connects(const Level& a, const Level& b, const RasterOptions& options) {
  const auto T = static_cast<float>(options.max_step);
  const float d = std::abs(a.surface.height - b.surface.height);
  if (d <= T) return true;
  if (d > 2 * T) return false;
  return (d - T) * (d - T) <= 4 * (a.surface.variance + b.surface.variance);
}

void find_seeds(const std::vector<PathPoint>& path, const RasterOptions& options, Tile& tile) {
  const double r = options.resolution;
  const Eigen::Vector2d low(tile.first.i * r, tile.first.j * r);
  const int steps = static_cast<int>(options.seed_radius / kSeedSpacing);
  // The places around the path that may lie in the tile, one to spare.
  const auto from = [&](double a) {
    return std::max(-steps, static_cast<int>(std::floor(a / kSeedSpacing)));
  };
  const auto to = [&](double a) {
    return std::min(steps, static_cast<int>(std::ceil((a + kSide * r) / kSeedSpacing)));
  };
  const auto row_of = [r](double y) { return static_cast<int>(std::floor(y / r)); };
  tile.votes.clear();
  for (const std::int32_t k : tile.seeds) {
    const Eigen::Vector3d& body = path[static_cast<std::size_t>(k)].position_map;
    const Eigen::Vector2d offset = low - body.head<2>();
    Vote best{k, -1, std::numeric_limits<double>::infinity()};
    for (int v = from(offset.y()); v <= to(offset.y()); ++v) {
      const int j = row_of(body.y() + kSeedSpacing * v) - tile.first.j;
      if (j < 0 || j >= kSide) continue;
      for (int u = from(offset.x()); u <= to(offset.x()); ++u) {
        const double distance = kSeedSpacing * std::sqrt(static_cast<double>(u * u + v * v));
        if (distance > options.seed_radius || 0.1 * distance >= best.score) continue;
        const int i = row_of(body.x() + kSeedSpacing * u) - tile.first.i;
        if (i < 0 || i >= kSide) continue;
        for (const Level& level : tile.levels_at(cell_in(i, j))) {
          const double dz = std::abs(static_cast<double>(level.surface.height) - body.z());
          if (dz > options.seed_tolerance + 0.1 * distance) continue;
          if (dz + 0.1 * distance < best.score) best = {k, level.component, dz + 0.1 * distance};
        }
      }
    }
    if (best.component >= 0) tile.votes.push_back(best);
  }
}

}  // namespace lamina::raster
