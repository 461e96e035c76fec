// Scan conversion of discs and outlines into a tile: internal to the rasterizer.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <lamina/grid/raster_bands.hpp>
#include <lamina/grid/raster_tile.hpp>

namespace lamina::raster {

constexpr float kSignificant = 3;  // sigma
constexpr double kAstride = 0.1;   // m: edges are known to this, tops and feet of walls to half

inline bool inside(int i, int j) { return i >= 0 && j >= 0 && i < kSide && j < kSide; }

/// How far the nearest disc is from each cell, over a tile and a margin around it.
class DiscDistance {
 public:
  DiscDistance(double resolution, double reach);
  /// `s` at a cell relative to the tile; outside is ignored. `of_plane`: its slope is a plane's; by
  /// itself a disc that lies astride a step leans, too.
  void mark(int i, int j, const Support& s, bool of_plane);
  /// Cells whose disc lies astride a step of the floor, no wider than a patch and no higher than
  /// what is one floor, are of one side.
  void sharpen(const RasterOptions& options);
  void wall(int i, int j, float low, float high);  ///< something upright stands there, map z
  /// Chamfer distances, once all is marked. `low` to `high` above a disc (m): walls there bar the
  /// way to the cells behind them.
  void spread(float low, float high);
  struct Nearest {
    double distance = 0;  ///< m
    double walked = 0;    ///< m, not through walls
    float height = 0;     ///< of the disc nearest by that way; of the other where there is none
  };
  Nearest at(int i, int j) const;
  /// The height of the disc over a cell (at most a tile's margin outside), NaN: none.
  float disc(int i, int j) const {
    const bool there = i >= -margin_ && j >= -margin_ && i < kSide + margin_ && j < kSide + margin_;
    if (!there || distance_[index(i, j)] != 0.0F) return std::numeric_limits<float>::quiet_NaN();
    return height_[index(i, j)];
  }
  /// Likewise, before steps were sharpened.
  float measured(int i, int j) const { return measured_[index(i, j)]; }
  /// Does a wall stand, in the robot's height above `floor`, within so much of the cell?
  bool wall_near(int i, int j, double reach, float floor) const;
  /// Does a disc lie within so much of the cell (in either direction), no further than `gap` from
  /// this height?
  bool disc_near(int i, int j, double reach, float height, float gap) const;

 private:
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>((j + margin_) * side_ + i + margin_);
  }
  double resolution_;
  int margin_, side_;
  void spread(std::vector<float>& distance, std::vector<float>& height, float low, float high,
              bool walls) const;
  void leave_out_astride(float low, float high);
  bool stands(std::size_t wall, float floor, float low, float high) const;
  std::vector<float> distance_, height_;  // cells
  std::vector<float> measured_;           // heights as marked, once steps are sharpened
  std::vector<float> variance_;
  std::vector<Trend> trend_;
  std::vector<float> walked_, walked_height_;
  std::vector<float> wall_low_, wall_high_;  // m, map z; none: high below low
  bool walls_ = false;
  float low_ = 0, high_ = 0;  // of the robot's height
};

/// How well planes tell the floor around a tile, by their own surfels there. A plane's covariance
/// holds all that its poses leave open; where it lies by its surfels is known better, and a plane's
/// fill meets them as neighbours.
///
/// Heights of a plane's surfels above it are normal with unknown mean and variance; the plane's own
/// covariance counts as one surfel more, at zero. The fill is what they predict of one more. Median
/// and median deviation tell them, so that a low platform that has no plane of its own is left out.
class LocalOffsets {
 public:
  void add(const Surfel& surfel) { surfels_.push_back(&surfel); }
  /// Once all are added.
  void sort();
  struct Offset {
    double mean = 0, squares = 0;  ///< m; m^2, about the mean
    double count = 1;              ///< the plane itself too
    /// Of a place where the plane alone has `variance` (m^2).
    double predictive(double variance) const {
      return (variance + squares) / count * (count > 1 ? 1 + 1 / count : 1);
    }
  };
  Offset of(const MapPlane& plane) const;

 private:
  std::vector<const Surfel*> surfels_;  // ascending by parent
};

/// Slopes of the planes of a tile, by their ids.
class Trends {
 public:
  void add(const MapPlane& plane) {
    const Eigen::Vector3d& n = plane.plane_map.normal();
    trends_.emplace_back(plane.id, Trend::of(-n.head<2>() / n.z()));
  }
  /// Of a plane; `own` where it is not among them.
  Trend of(std::int64_t id, Trend own) const {
    for (const auto& [plane, trend] : trends_) {
      if (plane == id) return trend;
    }
    return own;
  }

 private:
  std::vector<std::pair<std::int64_t, Trend>> trends_;
};

struct Canvas {
  Tile& tile;
  const RasterOptions& options;
  DiscDistance discs;
  LocalOffsets offsets;
  Trends trends;
  std::vector<Support> supports;
  std::vector<Obstacle> points;  ///< loose ones, ascending by cell

  Eigen::Vector2d center(int i, int j) const {
    return center_of({tile.first.i + i, tile.first.j + j}, options.resolution);
  }
  /// Does a loose point of the cell lie no more than a step from this height? It is of the surface
  /// there, then, and nothing that stands on it.
  bool met(std::int32_t cell, float height) const {
    const auto T = static_cast<float>(options.max_step);
    auto point = std::lower_bound(points.begin(), points.end(), cell,
                                  [](const Obstacle& p, std::int32_t c) { return p.cell < c; });
    for (; point != points.end() && point->cell == cell; ++point) {
      if (std::abs(point->high - height) <= T) return true;
    }
    return false;
  }
};

/// Something from z0 to z1 (map z, m) over a place.
void put_obstacle(const Eigen::Vector2d& xy, double z0, double z1, Canvas& canvas);
/// Reach of walls beyond a tile that matters to it, m.
double wall_reach(const RasterOptions& options);
void draw_disc(const Surfel& surfel, std::int32_t index, Canvas& canvas);
/// What stands in the cells a steep plane goes through, or passes within half a cell of.
void draw_walls(const MapPlane& plane, Canvas& canvas);
/// Surfaces and undersides cell by cell; nothing of steep planes.
/// `has_surfels`: anywhere, so that those tell its holes.
void draw_floor(const MapPlane& plane, std::int32_t index, bool has_surfels,
                const OutlineBands& bands, Canvas& canvas);
/// Levels of discs where steps were sharpened.
void sharpen_levels(const Canvas& canvas);
/// Loose points no further than the robot's step from a disc beside them are of its surface.
void settle_points(Canvas& canvas);
inline bool is_steep(const MapPlane& plane) {
  return std::abs(plane.plane_map.normal().z()) < kSteepCosine;
}

}  // namespace lamina::raster
