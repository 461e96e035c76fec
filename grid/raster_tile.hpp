// One tile of evidence while a map is drawn: internal to the rasterizer.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <unordered_map>
#include <vector>

#include <lamina/grid/raster_bands.hpp>
#include <lamina/grid/raster_mask.hpp>
#include <lamina/grid/rasterizer.hpp>

namespace lamina::raster {

constexpr double kSteepCosine = 0.5;  ///< |n.z| below: a wall, not a floor

/// Slopes of a plane in small.
struct Trend {
  static constexpr float kUnit = 1e-4F;  ///< m per m; steeper than 3.2 is no floor
  std::int16_t x = 0, y = 0;
  static Trend of(const Eigen::Vector2d& gradient) {
    const auto small = [](double slope) {
      return static_cast<std::int16_t>(
          std::clamp(slope / static_cast<double>(kUnit), -32767.0, 32767.0));
    };
    return {small(gradient.x()), small(gradient.y())};
  }
};

/// A surface seen from above, over the centre of a cell.
struct Support {
  std::int32_t cell = 0;
  std::int32_t source = 0;  ///< 2 index of a surfel, 2 index + 1 of a plane
  float height = 0;         ///< m, map z
  float variance = 0;       ///< m^2, of the height
  float slope_x = 0, slope_y = 0;
  float tilt_variance = 0;  ///< of the slope, any direction
  float reach = 0;          ///< distance from the disc's centre in radii; planes: kPlaneReach
  Trend trend;              ///< of the plane it is of; its own where it is of none

  static constexpr float kPlaneReach = 1e6F;
  static constexpr float kMetReach = 2;  ///< of a plane, with loose points at its height
  bool from_plane() const { return reach == kPlaneReach; }
};

/// Something solid in a cell from one height to another, m, map z.
struct Obstacle {
  std::int32_t cell = 0;
  float low = 0, high = 0;
};

/// One floor at a cell: what its supports say together.
struct Level {
  Support surface;
  std::int32_t component = 0;  ///< of the tile
};

enum Flag : std::uint8_t { kRim = 1, kKnowledgeEnd = 2 };

/// What stands at a cell once the robot's floor is known.
struct Site {
  float height = 0, variance = 0, slope_x = 0, slope_y = 0, tilt_variance = 0;
  float reference = 0;  ///< height of the floor the robot would come from
  float top = 0;        ///< highest thing a robot would touch
  std::int32_t source = 0;
  Trend trend;
  bool supported = false;      ///< there is a surface
  bool blocked = false;        ///< something solid within the robot's height
  bool reached = false;        ///< the surface is connected to the path
  bool met = false;            ///< it is not, and single points alone say that it is there
  bool surface_above = false;  ///< what blocks is a surface seen from above: it has an edge
  bool from_afar = false;      ///< `reference` is the floor of another place; no path leads here
  std::uint8_t flags = 0;
  // By the sites around (`look_around`).
  bool complete = true;     ///< something is known of all eight
  float step = 1;           ///< least probability that a step to one of them is at most T
  float low = 0, high = 0;  ///< of the surfaces there and here

  /// The same but for what the sites around say.
  bool chosen_as(const Site& other) const {
    return std::memcmp(this, &other, offsetof(Site, complete)) == 0;
  }
};
static_assert(std::is_trivially_copyable_v<Site> && offsetof(Site, complete) == 9 * 4 + 7);

/// A link between components of neighbouring tiles.
struct Link {
  std::int32_t here = 0, there = 0;
  bool operator==(const Link&) const = default;
};

/// The tile's best floor for a kept pose of the path; the least score of all tiles wins.
struct Vote {
  std::int32_t pose = 0, component = 0;
  double score = 0;
};

struct Tile {
  CellIndex first;
  // Evidence that touches the tile, ascending indices.
  std::vector<std::int32_t> surfels, planes, edges, points, seeds, references;
  // Drawn.
  std::vector<Level> levels;                         ///< by cell, then ascending
  std::array<std::uint16_t, kCells + 1> level_of{};  ///< first level of each cell
  std::vector<Obstacle> obstacles;                   ///< by cell, then ascending
  std::array<std::uint8_t, kCells> flags{};
  std::int32_t components = 0;
  std::vector<Vote> votes;                            ///< of the path, ascending by pose
  std::vector<char> reached;                          ///< of components
  std::vector<Link> right, above;                     ///< to the tiles there
  Tile *right_tile = nullptr, *above_tile = nullptr;  ///< where the links lead
  std::vector<Site> sites;                            ///< kCells or none
  CellMask changed, dirty;                            ///< sites; what to look at again

  // What the update under way has to do.
  bool redraw = false, reseed = false, rerefer = false, rechoose = false;
  bool waiting = false;              ///< is in the list of tiles with something to do
  std::int32_t first_component = 0;  ///< numbers of the tile's components in the whole map

  bool has_evidence() const {
    return !surfels.empty() || !planes.empty() || !edges.empty() || !points.empty();
  }
  /// Something was drawn: only then there may be sites that say anything.
  bool says_anything() const {
    return !levels.empty() || !obstacles.empty() ||
           std::any_of(flags.begin(), flags.end(), [](std::uint8_t f) { return f != 0; });
  }
  std::span<const Level> levels_at(int cell) const {
    const auto c = static_cast<std::size_t>(cell);
    return std::span(levels).subspan(level_of[c],
                                     static_cast<std::size_t>(level_of[c + 1] - level_of[c]));
  }
  std::span<Level> levels_at(int cell) {
    const auto c = static_cast<std::size_t>(cell);
    return std::span(levels).subspan(level_of[c],
                                     static_cast<std::size_t>(level_of[c + 1] - level_of[c]));
  }
  bool cut(int cell) const { return (flags[static_cast<std::size_t>(cell)] & kRim) != 0; }
};

inline int cell_in(int i, int j) { return j * kSide + i; }

/// Union-find; the least member is the root.
class Components {
 public:
  explicit Components(std::size_t n) : parent_(n) {
    for (std::size_t k = 0; k < n; ++k) parent_[k] = static_cast<std::int32_t>(k);
  }
  std::int32_t root(std::int32_t k) {
    while (up(k) != k) {
      up(k) = up(up(k));
      k = up(k);
    }
    return k;
  }
  void join(std::int32_t a, std::int32_t b) {
    a = root(a), b = root(b);
    up(std::max(a, b)) = std::min(a, b);
  }

 private:
  std::int32_t& up(std::int32_t k) { return parent_[static_cast<std::size_t>(k)]; }
  std::vector<std::int32_t> parent_;
};

/// Kept poses of the path: map position of the body.
struct PathPoint {
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
};

/// How many surfels have a plane for their parent, by its id; those with none are absent.
using SurfelCounts = std::unordered_map<std::int64_t, std::int64_t>;

/// Steps 1 and 2: evidence of the tile to levels, obstacles, flags; components of its levels.
/// False: all as it was.
bool draw_evidence(const PlanarMap& map, const SurfelCounts& surfels_of,
                   const RasterOptions& options, BandsOfPlanes& bands, Tile& tile);
/// Which of them lies best under each pose of the path. `path` as for the tile's seeds.
void find_seeds(const std::vector<PathPoint>& path, const RasterOptions& options, Tile& tile);
/// May a robot's floor go on from one level to the other? Generous: twice T where noise is large.
bool connects(const Level& a, const Level& b, const RasterOptions& options);
/// 3: which level is the robot's, and what blocks. `path` as for the references of the tile;
/// `fallback`: height of the floor where a camera was carried, and its path tells none (NaN: the
/// path does).
void choose_sites(const std::vector<PathPoint>& path, float fallback, const RasterOptions& options,
                  Tile& tile);
/// Lower bound (map z) of the lowest thing in a cell that is in the way of a robot on a floor at
/// `base`.
float lowest_solid(const Tile& tile, int cell, float base, const RasterOptions& options);
/// As above, or no sites where nothing is known any more; sets `changed`. What the sites around say
/// of the others stays.
void choose_again(const std::vector<PathPoint>& path, float fallback, const RasterOptions& options,
                  Tile& tile);

/// Sites of a tile and its neighbours by cell relative to the tile; nullptr: nothing there.
struct Neighbourhood {
  std::array<const Tile*, 9> tiles{};  ///< row by row from the lower left
  const Site* at(int i, int j) const {
    const auto u = static_cast<unsigned>(i + kSide), v = static_cast<unsigned>(j + kSide);
    const Tile* tile = tiles[v / kSide * 3 + u / kSide];
    if (tile == nullptr || tile->sites.empty()) return nullptr;
    return &tile->sites[v % kSide * kSide + u % kSide];
  }
};
/// The sites around cell (i, j) of the middle tile.
class SitesAround {
 public:
  /// None further than `reach` will be asked for.
  SitesAround(const Neighbourhood& tiles, int i, int j, int reach) : tiles_(&tiles), i_(i), j_(j) {
    const bool inside = std::min(i, j) >= reach && std::max(i, j) < kSide - reach;
    if (inside) middle_ = tiles.at(i, j);
  }
  /// nullptr: nothing there.
  const Site* at(int di, int dj) const {
    return middle_ != nullptr ? middle_ + dj * kSide + di : tiles_->at(i_ + di, j_ + dj);
  }

 private:
  const Neighbourhood* tiles_;
  int i_, j_;
  const Site* middle_ = nullptr;  // all lie in its tile
};
/// Cells beside an edge that are not called free.
int edge_cells(const RasterOptions& options);
/// Half a patch.
int patch_cells(const RasterOptions& options);
/// How far a verdict looks, cells.
inline int verdict_reach(const RasterOptions& options) {
  return std::max({2, edge_cells(options), patch_cells(options)});
}
/// 4: what the sites around, one away, say of a site.
void look_around(const SitesAround& around, const RasterOptions& options, Site& site);
/// 5: the layers of one cell, and what keeps it from a verdict. Sites up to `verdict_reach` away
/// must have looked around.
NavigabilityCell verdict(const SitesAround& around, const RasterOptions& options,
                         UnknownCause* unknown_cause = nullptr);

}  // namespace lamina::raster
