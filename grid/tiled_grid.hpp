// A grid in tiles: memory follows what is known, not the bounding box.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>

#include <lamina/grid/grid_geometry.hpp>

namespace lamina {

/// Cells live in tiles of 64 x 64, made when first written. Look-up of neighbours of the last cell
/// is quick (the last tile is remembered). Visits tiles in a fixed order (by row, then column).
template <class Cell>
class TiledGrid {
 public:
  static constexpr int kTile = 64;
  struct Tile {
    CellIndex first;
    std::array<Cell, static_cast<std::size_t>(kTile) * kTile> cells{};
    Cell& at(int i, int j) {
      return cells[static_cast<std::size_t>(j) * kTile + static_cast<std::size_t>(i)];
    }
    const Cell& at(int i, int j) const {
      return cells[static_cast<std::size_t>(j) * kTile + static_cast<std::size_t>(i)];
    }
  };

 private:
  using Key = std::pair<std::int32_t, std::int32_t>;  // (row, column) of the tile
  struct Last {                                       // the tile of the last look-up
    Tile* tile = nullptr;
    Key key;
  };

 public:
  explicit TiledGrid(double resolution = 0.05) : resolution_(resolution) {}
  TiledGrid(TiledGrid&&) noexcept = default;
  TiledGrid& operator=(TiledGrid&&) noexcept = default;

  double resolution() const { return resolution_; }
  bool empty() const { return tiles_.empty(); }
  std::size_t tile_count() const { return tiles_.size(); }

  /// The cell, made (with its tile) when it is not there.
  Cell& at_or_new(const CellIndex& c) {
    Tile& tile = tile_or_new(key_of(c));
    return tile.at(c.i - tile.first.i, c.j - tile.first.j);
  }
  /// Look-up for one of several threads, of a grid that none of them writes.
  class Look {
   public:
    explicit Look(const TiledGrid& grid) : grid_(grid) {}
    /// nullptr where no tile was made.
    const Cell* find(const CellIndex& c) { return grid_.find(c, last_); }

   private:
    const TiledGrid& grid_;
    Last last_;
  };

  /// nullptr where no tile was made.
  const Cell* find(const CellIndex& c) const { return find(c, last_); }
  Cell* find(const CellIndex& c) { return const_cast<Cell*>(std::as_const(*this).find(c)); }

  /// visit(CellIndex, Cell&) for every cell of every tile, tile by tile.
  template <class Visit>
  void for_each(Visit&& visit) {
    for (auto& [key, tile] : tiles_) {
      for (int j = 0; j < kTile; ++j) {
        for (int i = 0; i < kTile; ++i) {
          visit(CellIndex{tile->first.i + i, tile->first.j + j}, tile->at(i, j));
        }
      }
    }
  }
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [key, tile] : tiles_) {
      for (int j = 0; j < kTile; ++j) {
        for (int i = 0; i < kTile; ++i) {
          visit(CellIndex{tile->first.i + i, tile->first.j + j}, std::as_const(*tile).at(i, j));
        }
      }
    }
  }

  /// visit(CellIndex of the first, const Cell*) for the kTile cells of each tile in row `j`, by
  /// column.
  template <class Visit>
  void for_each_in_row(std::int32_t j, Visit&& visit) const {
    const std::int32_t row = key_of({0, j}).first;
    for (auto it = tiles_.lower_bound({row, INT32_MIN});
         it != tiles_.end() && it->first.first == row; ++it) {
      visit(CellIndex{it->second->first.i, j}, &it->second->at(0, j - it->second->first.j));
    }
  }

  /// The smallest rectangle of cells for which known(cell) is true; empty when none is.
  template <class Known>
  GridGeometry bounds(Known&& known) const {
    GridGeometry g{resolution_, {}, 0, 0};
    CellIndex low{INT32_MAX, INT32_MAX}, high{INT32_MIN, INT32_MIN};
    for_each([&](const CellIndex& c, const Cell& cell) {
      if (!known(cell)) return;
      low = {std::min(low.i, c.i), std::min(low.j, c.j)};
      high = {std::max(high.i, c.i), std::max(high.j, c.j)};
    });
    if (low.i > high.i) return g;
    g.first = low;
    g.width = high.i - low.i + 1;
    g.height = high.j - low.j + 1;
    return g;
  }

  void clear() {
    tiles_.clear();
    last_ = {};
  }

 private:
  static Key key_of(const CellIndex& c) { return {c.j >> 6, c.i >> 6}; }
  const Cell* find(const CellIndex& c, Last& last) const {
    const Key key = key_of(c);
    if (last.tile == nullptr || key != last.key) {
      const auto it = tiles_.find(key);
      if (it == tiles_.end()) return nullptr;
      last = {it->second.get(), key};
    }
    return &last.tile->at(c.i - last.tile->first.i, c.j - last.tile->first.j);
  }
  Tile& tile_or_new(const Key& key) {
    if (last_.tile != nullptr && key == last_.key) return *last_.tile;
    auto& tile = tiles_[key];
    if (!tile) {
      tile = std::make_unique<Tile>();
      tile->first = {key.second * kTile, key.first * kTile};
    }
    last_ = {tile.get(), key};
    return *tile;
  }

  double resolution_;
  std::map<Key, std::unique_ptr<Tile>> tiles_;
  mutable Last last_;  // not for several threads at once
};

}  // namespace lamina
