// Seen cells in the plane's own frame.
#include <lamina/backend/boundaries.hpp>

#include <limits>
#include <utility>

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

bool any_about(const OutlineGrid& grid, const OutlineGrid::Cell& cell) {
  for (int i = -1; i <= 1; ++i) {
    for (int j = -1; j <= 1; ++j) {
      if (grid.contains_cell({cell.first + i, cell.second + j})) return true;
    }
  }
  return false;
}

std::vector<Eigen::Vector3d> in_map(const PlaneLandmark& plane, const Polygon& polygon) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& v : polygon.vertices()) {
    points.push_back(plane.T_map_outline * Eigen::Vector3d(v.x(), v.y(), 0));
  }
  return points;
}

}  // namespace

void grow_outline(PlaneLandmark& plane, std::span<const Eigen::Vector3d> points_map) {
  const SE3 T_outline_map = plane.T_map_outline.inverse();
  std::vector<Eigen::Vector2d> flat;
  for (const auto& p : points_map) {
    if (!p.allFinite()) return;
    flat.push_back((T_outline_map * p).head<2>());
  }
  if (flat.size() < 2) return;
  if (flat.size() == 2) return plane.outline.add_stroke(flat[0], flat[1]);
  OutlineGrid inside(plane.outline.cell_size()), border(plane.outline.cell_size());
  for (std::size_t i = 0; i < flat.size(); ++i)
    border.add_stroke(flat[i], flat[(i + 1) % flat.size()]);
  if (const auto polygon = Polygon::from_vertices(std::move(flat))) inside.add(*polygon);
  plane.outline.merge(inside);
  // Thin pieces must not fall between the cells' centres; thin ends of others are as good as noise.
  if (2 * inside.size() >= border.size()) return;
  OutlineGrid thin(plane.outline.cell_size());
  for (const auto& cell : border.cells()) {
    if (!any_about(inside, cell)) thin.add_cell(cell);
  }
  // Where it turns from thin to wide, and where a slanting one meets a centre now and then.
  const OutlineGrid alone = thin;
  for (const auto& [i, j] : border.cells()) {
    const bool beside = alone.contains_cell({i - 1, j}) || alone.contains_cell({i + 1, j}) ||
                        alone.contains_cell({i, j - 1}) || alone.contains_cell({i, j + 1});
    if (beside) thin.add_cell({i, j});
  }
  plane.outline.merge(thin);
}

void remake_outline(PlaneLandmark& plane, std::span<const OutlinePiece> pieces, const Graph& graph,
                    double cell_size) {
  plane.T_map_outline = plane_frame(plane.plane_map(), plane.anchor_map);
  plane.outline = OutlineGrid(cell_size);
  std::vector<Eigen::Vector3d> points_map;
  for (const auto& piece : pieces) {
    const Keyframe* keyframe = graph.find(piece.keyframe);
    if (keyframe == nullptr) continue;
    points_map.clear();
    for (const auto& p : piece.points_body) points_map.push_back(keyframe->T_map_body * p);
    grow_outline(plane, points_map);
  }
}

std::vector<std::vector<Eigen::Vector3d>> outlines_map(const PlaneLandmark& plane) {
  std::vector<std::vector<Eigen::Vector3d>> result;
  for (const Polygon& polygon : plane.outline.outlines()) result.push_back(in_map(plane, polygon));
  return result;
}

std::vector<Eigen::Vector3d> ring_map(const PlaneLandmark& plane) {
  std::vector<Polygon> parts = plane.outline.outlines();
  if (parts.size() > 1) {
    OutlineGrid joined = plane.outline;
    for (const Strip& strip : strips_between(parts, joined.cell_size()))
      joined.add_stroke(strip.from, strip.to);
    parts = joined.outlines();
  }
  if (parts.empty()) return {};
  return in_map(plane, parts.front());
}

Eigen::Vector3d outline_centroid_map(const PlaneLandmark& plane) {
  if (plane.outline.empty()) return plane.anchor_map;
  const double cell = plane.outline.cell_size();
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const auto& [i, j] : plane.outline.cells()) sum += Eigen::Vector2d(i + 0.5, j + 0.5) * cell;
  sum /= static_cast<double>(plane.outline.size());
  return plane.T_map_outline * Eigen::Vector3d(sum.x(), sum.y(), 0);
}

}  // namespace lamina
