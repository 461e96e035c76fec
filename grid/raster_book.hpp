// Which evidence touches which tile, and what changed: internal to the rasterizer.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <unordered_set>
#include <utility>
#include <vector>

#include <lamina/grid/raster_tile.hpp>

namespace lamina::raster {

/// Tiles by (row, column).
using TileKey = std::pair<std::int32_t, std::int32_t>;
using Tiles = std::map<TileKey, std::unique_ptr<Tile>>;
inline TileKey key_of(const Tile& tile) { return {tile.first.j / kSide, tile.first.i / kSide}; }

/// Keeps the lists of evidence in the tiles, and marks what must be drawn again.
class Book {
 public:
  explicit Book(const RasterOptions& options) : options_(options) {}
  /// Everything is compared with what it was.
  void update(const PlanarMap& map);
  /// Only what is listed, the ends of the lists, and the end of the path.
  void update(const PlanarMap& map, const RasterChanges& changes);

  /// Visits the tiles that hold a seed, ascending by key.
  template <class Visit>
  void at_seed(std::size_t seed, const Visit& visit) const {
    const Item& item = seeds_.items[seed];
    for (std::int32_t j = item.j0; j <= item.j1; ++j) {
      for (std::int32_t i = item.i0; i <= item.i1; ++i) visit(*tiles.find({j, i})->second);
    }
  }

  Tiles tiles;
  SurfelCounts surfels_of;
  std::vector<Tile*> marked;                 ///< tiles with something to do, each once
  std::vector<PathPoint> seeds, references;  ///< of the path, one every so far

 private:
  /// Tiles from (i0, j0) to (i1, j1); none when i0 > i1.
  struct Item {
    std::uint64_t digest = 0;
    std::int32_t i0 = 1, j0 = 1, i1 = 0, j1 = 0;
    std::int64_t plane = -1;  ///< id: of a plane itself, of a surfel's parent
  };
  using List = std::vector<std::int32_t> Tile::*;
  struct Kind {
    List list;
    bool Tile::*mark;
    std::vector<Item> items;
  };
  Item covering(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double margin) const;
  Item item(const Surfel& surfel) const;
  Item item(const MapPlane& plane) const;
  Item item(const EdgePoint& edge) const;
  Item item(const Eigen::Vector3d& point) const;
  void mark(Tile& tile, bool Tile::*what);
  void place(Kind& kind, std::size_t index, const Item& item);
  void cut(Kind& kind, std::size_t size);
  template <class T>
  void compare(Kind& kind, const std::vector<T>& list, std::size_t from);
  template <class T>
  void compare(Kind& kind, const std::vector<T>& list, const std::vector<std::size_t>& listed);
  /// A surfel leaves its parent for another.
  void adopt(std::int64_t from, std::int64_t to);
  /// Tiles of planes that got their first surfel or lost all.
  void mark_adopted();
  void follow(const Trajectory& path, bool from_start);
  void place_path();

  RasterOptions options_;
  Kind surfels_{&Tile::surfels, &Tile::redraw, {}}, planes_{&Tile::planes, &Tile::redraw, {}},
      edges_{&Tile::edges, &Tile::redraw, {}}, points_{&Tile::points, &Tile::redraw, {}},
      seeds_{&Tile::seeds, &Tile::reseed, {}}, references_{&Tile::references, &Tile::rerefer, {}};
  std::unordered_set<std::int64_t> adopted_;  ///< planes that got their first surfel or lost all
  std::size_t followed_ = 0;                  ///< poses of the path looked at
};

}  // namespace lamina::raster
