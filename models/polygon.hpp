// Outlines in a plane's own frame.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <lamina/models/outline_grid.hpp>  // what outlines grow from: the union of what was seen

namespace lamina {

/// A simple polygon (convex or concave, no holes) in the x-y of a plane frame, in metres.
/// Vertices run counter-clockwise, without repeating the first.
class Polygon {
 public:
  Polygon() = default;
  /// Reverses clockwise input and drops repeated vertices. nullopt for fewer than three distinct
  /// vertices, zero area (to rounding) or anything not finite.
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
  /// The part inside a convex polygon (Sutherland-Hodgman); nullopt when nothing is left. Where a
  /// concave outline falls into several parts, they are joined by edges of no width.
  std::optional<Polygon> clipped(const Polygon& convex) const;
  /// Douglas-Peucker: no vertex moves, none left out is further than `tolerance` from the outline.
  Polygon simplified(double tolerance) const;

 private:
  std::vector<Eigen::Vector2d> vertices_;
};

}  // namespace lamina
