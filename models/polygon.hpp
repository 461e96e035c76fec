// Outlines in a plane's own frame, and the evidence they grow from.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace lamina {

/// A simple polygon (convex or concave, no holes) in the x-y of a plane frame, in metres.
/// Vertices run counter-clockwise, without repeating the first.
class Polygon {
 public:
  Polygon() = default;
  /// Reverses clockwise input and drops repeated vertices. nullopt for fewer than three distinct
  /// vertices, zero area or anything not finite.
  static std::optional<Polygon> from_vertices(std::vector<Eigen::Vector2d> vertices);
  /// Convex hull by monotone chain; nullopt as above.
  static std::optional<Polygon> convex_hull(std::span<const Eigen::Vector2d> points);

  const std::vector<Eigen::Vector2d>& vertices() const { return vertices_; }
  bool empty() const { return vertices_.empty(); }
  double area() const;
  Eigen::Vector2d centroid() const;
  /// Inside or on the border (to rounding).
  bool contains(const Eigen::Vector2d& point) const;
  /// Distance to the border, negative inside.
  double signed_distance(const Eigen::Vector2d& point) const;
  /// Lower left and upper right corner.
  std::pair<Eigen::Vector2d, Eigen::Vector2d> bounds() const;
  /// The part inside a convex polygon (Sutherland-Hodgman); nullopt when nothing is left.
  std::optional<Polygon> clipped(const Polygon& convex) const;
  /// Douglas-Peucker: no vertex moves, none left out is further than `tolerance` from the outline.
  Polygon simplified(double tolerance) const;

 private:
  std::vector<Eigen::Vector2d> vertices_;
};

/// Which small squares of a plane have been seen. Grows by union; its outline is concave where the
/// evidence is. Cell (i, j) covers [i, i+1) x [j, j+1) times `cell_size`.
class OutlineGrid {
 public:
  explicit OutlineGrid(double cell_size = 0.1) : cell_size_(cell_size) {}
  double cell_size() const { return cell_size_; }
  bool empty() const { return cells_.empty(); }
  std::size_t size() const { return cells_.size(); }
  void add(const Eigen::Vector2d& point);
  /// Cells the stroke crosses: what a scan segment has seen of a plane.
  void add_stroke(const Eigen::Vector2d& a, const Eigen::Vector2d& b);
  /// Cells whose centre is inside.
  void add(const Polygon& polygon);
  void merge(const OutlineGrid& other);
  bool contains(const Eigen::Vector2d& point) const;
  double area() const { return static_cast<double>(cells_.size()) * cell_size_ * cell_size_; }
  /// Outer outlines of the connected parts (4-neighbour), largest first, simplified to half a cell.
  /// Gaps up to `close_cells` wide are bridged before tracing.
  std::vector<Polygon> outlines(int close_cells = 1) const;
  const std::set<std::pair<std::int32_t, std::int32_t>>& cells() const { return cells_; }

 private:
  double cell_size_;
  std::set<std::pair<std::int32_t, std::int32_t>> cells_;
};

}  // namespace lamina
