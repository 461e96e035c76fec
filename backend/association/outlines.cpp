// Seen cells in the plane's own frame.
#include <lamina/backend/association/outlines.hpp>

#include <utility>

#include <lamina/models/placed_outline.hpp>

namespace lamina {
namespace {

bool any_about(const OutlineGrid& grid, const OutlineGrid::Cell& cell) {
  for (int i = -1; i <= 1; ++i) {
    for (int j = -1; j <= 1; ++j) {
      if (grid.contains_cell({cell.first + i, cell.second + j})) return true;
    }
  }
  return false;
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
  return outlines_in(plane.outline, plane.T_map_outline);
}

std::vector<Eigen::Vector3d> ring_map(const PlaneLandmark& plane) {
  return ring_in(plane.outline, plane.T_map_outline);
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
