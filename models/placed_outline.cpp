// Polygons of the grid, moved; parts joined by the shortest tree.
#include <lamina/models/placed_outline.hpp>

#include <limits>

#include <lamina/models/polygon.hpp>

namespace lamina {
namespace {

struct Strip {
  Eigen::Vector2d from, to;
  double length = std::numeric_limits<double>::infinity();
};

Strip nearest(const Polygon& a, const Polygon& b) {
  Strip best;
  for (const auto& p : a.vertices()) {
    for (const auto& q : b.vertices()) {
      if ((q - p).norm() < best.length) best = {p, q, (q - p).norm()};
    }
  }
  return best;
}

// A point within the part beside a corner of it: on the corner, a strip would run along the border.
Eigen::Vector2d within(const Polygon& part, const Eigen::Vector2d& corner, double cell) {
  for (const double step : {0.5, 1.0}) {
    for (const double x : {-step, step}) {
      for (const double y : {-step, step}) {
        const Eigen::Vector2d p = corner + cell * Eigen::Vector2d(x, y);
        if (part.contains(p)) return p;
      }
    }
  }
  return corner;
}

// The shortest tree over all parts (Prim).
std::vector<Strip> strips_between(const std::vector<Polygon>& parts, double cell) {
  std::vector<Strip> tree, to_tree(parts.size());
  std::vector<std::size_t> neighbour(parts.size(), 0);
  std::vector<bool> in_tree(parts.size(), false);
  std::size_t last = 0;
  for (std::size_t n = 1; n < parts.size(); ++n) {
    in_tree[last] = true;
    std::size_t next = parts.size();
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (in_tree[i]) continue;
      const Strip strip = nearest(parts[last], parts[i]);
      if (strip.length < to_tree[i].length) {
        to_tree[i] = strip;
        neighbour[i] = last;
      }
      if (next == parts.size() || to_tree[i].length < to_tree[next].length) next = i;
    }
    Strip& strip = tree.emplace_back(to_tree[next]);
    strip.from = within(parts[neighbour[next]], strip.from, cell);
    strip.to = within(parts[next], strip.to, cell);
    last = next;
  }
  return tree;
}

std::vector<Eigen::Vector3d> moved(const Polygon& polygon, const SE3& T_map_outline) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& v : polygon.vertices()) {
    points.push_back(T_map_outline * Eigen::Vector3d(v.x(), v.y(), 0));
  }
  return points;
}

}  // namespace

std::vector<std::vector<Eigen::Vector3d>> outlines_in(const OutlineGrid& outline,
                                                      const SE3& T_map_outline) {
  std::vector<std::vector<Eigen::Vector3d>> result;
  for (const Polygon& polygon : outline.outlines()) result.push_back(moved(polygon, T_map_outline));
  return result;
}

std::vector<Eigen::Vector3d> ring_in(const OutlineGrid& outline, const SE3& T_map_outline) {
  std::vector<Polygon> parts = outline.outlines();
  if (parts.size() > 1) {
    OutlineGrid joined = outline;
    for (const Strip& strip : strips_between(parts, joined.cell_size()))
      joined.add_stroke(strip.from, strip.to);
    parts = joined.outlines();
  }
  if (parts.empty()) return {};
  return moved(parts.front(), T_map_outline);
}

}  // namespace lamina
