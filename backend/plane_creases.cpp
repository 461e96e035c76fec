// Small slanting planes against what was seen at the same place.
#include <lamina/backend/plane_creases.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/backend/plane_index.hpp>
#include <lamina/models/polygon.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kLevel = 10 * kDegree, kUpright = 73 * kDegree;
constexpr double kTurned = 10 * kDegree;
constexpr double kNear = 0.05;  // m from the other plane
constexpr double kBeside =
    0.15;  // m beside what a view saw of it: cells of outlines, and images' blocks
constexpr std::size_t kFew = 6, kTimes = 2;
constexpr double kShare = 0.9;
constexpr double kSpacing = 0.05;  // m

using Outlines = std::map<PlaneId, std::vector<OutlinePiece>>;

std::set<KeyframeId> keyframes_of(const Graph& graph, const std::vector<OutlinePiece>& pieces) {
  std::set<KeyframeId> all;
  for (const auto& piece : pieces) {
    if (graph.find(piece.keyframe)) all.insert(piece.keyframe);
  }
  return all;
}

bool has_area(const OutlinePiece& piece) { return piece.points_body.size() > 2; }

// What keyframes saw of a plane, in the plane.
class Views {
 public:
  Views(const Graph& graph, const PlaneLandmark& plane, const std::vector<OutlinePiece>& pieces)
      : plane_(&plane), T_outline_map_(plane.T_map_outline.inverse()) {
    for (const auto& piece : pieces) {
      const Keyframe* keyframe = graph.find(piece.keyframe);
      if (!keyframe || !has_area(piece)) continue;
      std::vector<Eigen::Vector2d> flat;
      const SE3 T = T_outline_map_ * keyframe->T_map_body;
      for (const auto& p : piece.points_body) flat.push_back((T * p).head<2>());
      if (auto polygon = Polygon::from_vertices(std::move(flat))) {
        outlines_.emplace_back(piece.keyframe, std::move(*polygon));
      }
    }
  }
  // Whether at least `n` keyframes saw the plane at a point near it.
  bool seen(const Eigen::Vector3d& p_map, std::size_t n) const {
    if (std::abs(plane_->plane_map().signed_distance(p_map)) > kNear) return false;
    const Eigen::Vector2d p = (T_outline_map_ * p_map).head<2>();
    std::set<KeyframeId> there;
    for (const auto& [id, outline] : outlines_) {
      if (outline.signed_distance(p) <= kBeside) there.insert(id);
      if (there.size() >= n) return true;
    }
    return false;
  }

 private:
  const PlaneLandmark* plane_;
  SE3 T_outline_map_;
  std::vector<std::pair<KeyframeId, Polygon>> outlines_;
};

bool is_crease(const Graph& graph, const Outlines& outlines, const PlaneLandmark& plane,
               const std::vector<Eigen::Vector3d>& points, std::size_t views) {
  std::vector<bool> explained(points.size(), false);
  for (const PlaneLandmark& other : graph.planes) {
    if (!other.active || other.id == plane.id || outlines.count(other.id) == 0) continue;
    if (angle_between(other.plane_anchor, plane.plane_anchor) < kTurned) continue;
    const Plane there = other.plane_map();
    const bool close = std::any_of(points.begin(), points.end(), [&](const auto& p) {
      return std::abs(there.signed_distance(p)) <= kNear;
    });
    const auto& pieces = outlines.at(other.id);
    if (!close || keyframes_of(graph, pieces).size() < kTimes * views) continue;
    const Views seen(graph, other, pieces);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!explained[i]) explained[i] = seen.seen(points[i], kTimes * views);
    }
  }
  const auto n = std::count(explained.begin(), explained.end(), true);
  return static_cast<double>(n) >= kShare * static_cast<double>(points.size());
}

}  // namespace

std::set<PlaneId> creases(const Graph& graph, const Outlines& outlines) {
  std::set<PlaneId> found;
  for (const PlaneLandmark& plane : graph.planes) {
    const auto pieces = outlines.find(plane.id);
    if (!plane.active || pieces == outlines.end()) continue;
    const double slope = std::acos(std::min(1.0, std::abs(plane.plane_anchor.normal().z())));
    if (slope < kLevel || slope > kUpright) continue;
    const std::size_t views = keyframes_of(graph, pieces->second).size();
    if (views > kFew) continue;
    std::vector<Eigen::Vector3d> points;
    for (const auto& piece : pieces->second) {
      const Keyframe* keyframe = graph.find(piece.keyframe);
      if (!keyframe || !has_area(piece)) continue;
      for (const auto& p : sample_outline(piece.points_body, kSpacing)) {
        points.push_back(keyframe->T_map_body * p);
      }
    }
    if (!points.empty() && is_crease(graph, outlines, plane, points, views)) {
      found.insert(plane.id);
    }
  }
  return found;
}

}  // namespace lamina
