// By which keyframes see which plane.
#include <lamina/backend/association/outline_split.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

namespace lamina {
namespace {

// Copies of the pieces that keyframes in `sees` have, where `pieces` has none of a known keyframe.
void lend(const Graph& graph, const std::set<KeyframeId>& sees,
          const std::vector<OutlinePiece>& from, std::vector<OutlinePiece>& pieces) {
  const auto known = [&](const OutlinePiece& p) { return graph.find(p.keyframe) != nullptr; };
  if (std::any_of(pieces.begin(), pieces.end(), known)) return;
  std::copy_if(from.begin(), from.end(), std::back_inserter(pieces),
               [&](const OutlinePiece& p) { return sees.count(p.keyframe) > 0; });
}

}  // namespace

void share_pieces(const Graph& graph, PlaneId old, PlaneId made,
                  std::vector<OutlinePiece>& pieces_old, std::vector<OutlinePiece>& pieces_made) {
  const Plane plane_old = graph.at(old).plane_map(), plane_made = graph.at(made).plane_map();
  std::set<KeyframeId> see_old, see_made;
  for (const auto& f : graph.plane_moments) {
    if (f.plane == old) see_old.insert(f.keyframe);
    if (f.plane == made) see_made.insert(f.keyframe);
  }
  const auto first_made =
      std::stable_partition(pieces_old.begin(), pieces_old.end(), [&](const OutlinePiece& p) {
        const Keyframe* keyframe = graph.find(p.keyframe);
        if (!keyframe || see_made.count(p.keyframe) == 0) return true;
        if (see_old.count(p.keyframe) == 0) return false;
        double off_old = 0, off_made = 0;
        for (const auto& x : p.points_body) {
          off_old += std::abs(plane_old.signed_distance(keyframe->T_map_body * x));
          off_made += std::abs(plane_made.signed_distance(keyframe->T_map_body * x));
        }
        return off_old <= off_made;
      });
  pieces_made.insert(pieces_made.end(), std::make_move_iterator(first_made),
                     std::make_move_iterator(pieces_old.end()));
  pieces_old.erase(first_made, pieces_old.end());
  lend(graph, see_made, pieces_old, pieces_made);
  lend(graph, see_old, pieces_made, pieces_old);
}

OutlineGrid outline_of_views(const PlaneLandmark& plane, const Graph& graph) {
  OutlineGrid outline(plane.outline.cell_size());
  const SE3 T_outline_map = plane.T_map_outline.inverse();
  for (const auto& f : graph.plane_moments) {
    const Keyframe* keyframe = f.plane == plane.id ? graph.find(f.keyframe) : nullptr;
    if (keyframe == nullptr) continue;
    const Eigen::Vector3d middle = T_outline_map * (keyframe->T_map_body * f.moments_body.mean());
    outline.add(Eigen::Vector2d(middle.head<2>()));
  }
  return outline;
}

}  // namespace lamina
