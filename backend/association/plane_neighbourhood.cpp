// A hash of places over the outlines, by the keyframes' present poses.
#include <lamina/backend/association/plane_neighbourhood.hpp>

#include <algorithm>

#include <lamina/backend/association/outline_gap.hpp>

namespace lamina {
namespace {

constexpr double kSpacing = 0.25;  // m, of points on outlines

bool all_strokes(const std::vector<OutlinePiece>& pieces) {
  return std::all_of(pieces.begin(), pieces.end(),
                     [](const OutlinePiece& piece) { return piece.points_body.size() <= 2; });
}

}  // namespace

PlaneNeighbourhood::PlaneNeighbourhood(const Graph& graph,
                                       const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
                                       double gap_m, bool lines)
    : graph_(graph), gap_(gap_m), index_(lines ? gap_m / 2 : gap_m) {
  for (const auto& f : graph.plane_moments) {
    const PlaneLandmark& plane = graph.at(f.plane);
    if (f.weight < 0.5 || !plane.active) continue;
    const SE3& T = graph.at(f.keyframe).T_map_body;
    PinnedViews& seen = seen_[f.plane];
    seen.anchor.merge(f.moments_body.transformed(SE3(T.so3(), T.translation() - plane.anchor_map)));
    ++seen.views;
  }
  for (const auto& [id, seen] : seen_) {
    const auto pieces = outlines.find(id);
    if (pieces == outlines.end()) continue;
    const bool line = all_strokes(pieces->second);
    if (lines && !line) continue;
    if (line) lines_.insert(id);
    auto& points = samples_[id];
    for (const auto& piece : pieces->second) {
      const Keyframe* keyframe = graph.find(piece.keyframe);
      if (!keyframe) continue;
      std::vector<Eigen::Vector3d> outline;
      for (const auto& p : piece.points_body) outline.push_back(keyframe->T_map_body * p);
      const auto more = sample_outline(outline, lines ? index_.cell() : kSpacing);
      points.insert(points.end(), more.begin(), more.end());
    }
    index_.insert(id, points);
  }
}

std::vector<std::pair<PlaneId, PlaneId>> PlaneNeighbourhood::pairs(double max_angle) const {
  std::vector<std::pair<PlaneId, PlaneId>> found;
  for (const auto& [a, points] : samples_) {
    for (const PlaneId b : index_.near(points)) {
      const bool first = std::pair(seen_.at(a).views, b) < std::pair(seen_.at(b).views, a);
      if (a == b || !first || (lines_.count(a) > 0 && lines_.count(b) > 0)) continue;
      if (angle_between(graph_.at(a).plane_anchor, graph_.at(b).plane_anchor) > max_angle) {
        continue;
      }
      found.emplace_back(a, b);
    }
  }
  return found;
}

bool PlaneNeighbourhood::beside(PlaneId a, PlaneId b) const {
  return lamina::beside(samples_.at(a), samples_.at(b), gap_);
}

std::vector<PlaneId> PlaneNeighbourhood::smallest_first() const {
  std::vector<PlaneId> order;
  for (const auto& [id, points] : samples_) order.push_back(id);
  std::stable_sort(order.begin(), order.end(),
                   [this](PlaneId a, PlaneId b) { return seen_.at(a).views < seen_.at(b).views; });
  return order;
}

std::vector<PlaneId> PlaneNeighbourhood::around(PlaneId a) const {
  std::vector<PlaneId> found = index_.near(samples_.at(a));
  std::erase_if(found, [&](PlaneId b) { return b == a || gone_.count(b) > 0; });
  return found;
}

void PlaneNeighbourhood::join(PlaneId from, PlaneId into) {
  PinnedViews& kept = seen_.at(into);
  const Eigen::Vector3d shift = graph_.at(from).anchor_map - graph_.at(into).anchor_map;
  kept.anchor.merge(seen_.at(from).anchor.transformed(SE3::from_translation(shift)));
  kept.views += seen_.at(from).views;
  index_.rename(from, into);
  gone_.insert(from);
  auto& all = members_[into];
  for (const PlaneId id : members(from)) all.push_back(id);
}

std::vector<PlaneId> PlaneNeighbourhood::members(PlaneId id) const {
  std::vector<PlaneId> all{id};
  const auto joined = members_.find(id);
  if (joined != members_.end()) {
    all.insert(all.end(), joined->second.begin(), joined->second.end());
  }
  return all;
}

}  // namespace lamina
