// Seen cells in the plane's own frame.
#include <lamina/backend/boundaries.hpp>

namespace lamina {

void grow_outline(PlaneLandmark& plane, std::span<const Eigen::Vector3d> points_map) {
  const SE3 T_outline_map = plane.T_map_outline.inverse();
  std::vector<Eigen::Vector2d> flat;
  for (const auto& p : points_map) {
    if (!p.allFinite()) return;
    flat.push_back((T_outline_map * p).head<2>());
  }
  if (flat.size() < 2) return;
  // The border itself was seen too: thin pieces must not fall between the cells' centres.
  for (std::size_t i = 0; i + 1 < flat.size(); ++i) plane.outline.add_stroke(flat[i], flat[i + 1]);
  if (flat.size() < 3) return;
  plane.outline.add_stroke(flat.back(), flat.front());
  if (const auto polygon = Polygon::from_vertices(std::move(flat))) plane.outline.add(*polygon);
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
  for (const Polygon& polygon : plane.outline.outlines()) {
    auto& outline = result.emplace_back();
    for (const auto& v : polygon.vertices()) {
      outline.push_back(plane.T_map_outline * Eigen::Vector3d(v.x(), v.y(), 0));
    }
  }
  return result;
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
