// Outlines of keyframes as polygons of the plane.
#include <lamina/backend/association/observed_extent.hpp>

#include <lamina/backend/association/plane_index.hpp>

namespace lamina {
namespace {

bool has_area(const OutlinePiece& piece) { return piece.points_body.size() > 2; }

}  // namespace

std::set<KeyframeId> keyframes_of(const Graph& graph, const std::vector<OutlinePiece>& pieces) {
  std::set<KeyframeId> all;
  for (const auto& piece : pieces) {
    if (graph.find(piece.keyframe)) all.insert(piece.keyframe);
  }
  return all;
}

std::vector<Eigen::Vector3d> seen_points(const Graph& graph,
                                         const std::vector<OutlinePiece>& pieces, double spacing) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& piece : pieces) {
    const Keyframe* keyframe = graph.find(piece.keyframe);
    if (!keyframe || !has_area(piece)) continue;
    for (const auto& p : sample_outline(piece.points_body, spacing))
      points.push_back(keyframe->T_map_body * p);
  }
  return points;
}

SeenPlane::SeenPlane(const Graph& graph, const PlaneLandmark& plane,
                     const std::vector<OutlinePiece>& pieces)
    : T_outline_map_(plane.T_map_outline.inverse()) {
  for (const auto& piece : pieces) {
    const Keyframe* keyframe = graph.find(piece.keyframe);
    if (!keyframe || !has_area(piece)) continue;
    std::vector<Eigen::Vector2d> flat;
    const SE3 T = T_outline_map_ * keyframe->T_map_body;
    for (const auto& p : piece.points_body) flat.push_back((T * p).head<2>());
    if (auto polygon = Polygon::from_vertices(std::move(flat)))
      outlines_.emplace_back(piece.keyframe, std::move(*polygon));
  }
}

bool SeenPlane::seen(const Eigen::Vector3d& p_map, std::size_t n, double beside) const {
  const Eigen::Vector2d p = (T_outline_map_ * p_map).head<2>();
  std::set<KeyframeId> there;
  for (const auto& [id, outline] : outlines_) {
    if (outline.signed_distance(p) <= beside) there.insert(id);
    if (there.size() >= n) return true;
  }
  return false;
}

}  // namespace lamina
