// Which part of a plane has been seen: the union of outlines, as a plane grows.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace lamina {

class Polygon;

/// Small squares in the x-y of a plane frame. Grows by union; its outline is concave where the
/// evidence is. Cell (i, j) covers [i, i+1) x [j, j+1) times `cell_size`. Kept as tiles of 8 x 8
/// bits: a cell costs one bit where the evidence is dense, and a union is an `or` of tiles.
class OutlineGrid {
 public:
  using Cell = std::pair<std::int32_t, std::int32_t>;

  explicit OutlineGrid(double cell_size = 0.1) : cell_size_(cell_size) {}
  double cell_size() const { return cell_size_; }
  bool empty() const { return tiles_.empty(); }
  std::size_t size() const { return size_; }
  void add_cell(const Cell& cell);
  /// Ignores points that are not finite or further than 1e9 cells away.
  void add(const Eigen::Vector2d& point);
  /// Every cell the stroke passes: what a scan segment has seen of a plane.
  void add_stroke(const Eigen::Vector2d& a, const Eigen::Vector2d& b);
  /// Cells whose centre is inside.
  void add(const Polygon& polygon);
  /// Union. Cells of another size count for the cells of this whose centres they hold, and for the
  /// one their own centre is in.
  void merge(const OutlineGrid& other);
  bool contains(const Eigen::Vector2d& point) const;
  bool contains_cell(const Cell& cell) const;
  double area() const { return static_cast<double>(size_) * cell_size_ * cell_size_; }
  /// Outer outlines of the connected parts (4-neighbour), largest first, simplified to three
  /// quarters of a cell (the steps of a slanting border go). Gaps up to 2 `close_cells` wide are
  /// bridged before tracing; holes are not told.
  std::vector<Polygon> outlines(int close_cells = 1) const;
  /// All cells, ascending.
  std::vector<Cell> cells() const;

 private:
  double cell_size_;
  std::size_t size_ = 0;
  std::map<Cell, std::uint64_t> tiles_;  ///< by (i / 8, j / 8); bit 8 (i % 8) + j % 8; never 0
};

}  // namespace lamina
