// Small slanting planes against what was seen at the same place.
#include <lamina/backend/consistency/plane_creases.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/backend/association/observed_extent.hpp>

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
    const SeenPlane seen(graph, other, pieces);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!explained[i] && std::abs(there.signed_distance(points[i])) <= kNear)
        explained[i] = seen.seen(points[i], kTimes * views, kBeside);
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
    const auto points = seen_points(graph, pieces->second, kSpacing);
    if (!points.empty() && is_crease(graph, outlines, plane, points, views)) {
      found.insert(plane.id);
    }
  }
  return found;
}

}  // namespace lamina
