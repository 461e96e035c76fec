// Rarely seen planes against those that were seen at the same place.
#include <lamina/backend/consistency/plane_ghosts.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/backend/association/observed_extent.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kUpright = 73 * kDegree;
constexpr double kTurned = 10 * kDegree, kAcross = 45 * kDegree;
constexpr double kThrough = 0.07;    // m on either side of the other plane
constexpr std::size_t kFew = 6;      // keyframes
constexpr std::int64_t kTimes = 10;  // frames and scans
constexpr double kOver = 0.5;        // of it, before or behind what was seen of the other
constexpr double kShare = 0.2;       // of that, on either side
constexpr double kSpacing = 0.1;     // m

using Outlines = std::map<PlaneId, std::vector<OutlinePiece>>;

bool upright(const PlaneLandmark& plane) {
  return std::abs(plane.plane_anchor.normal().z()) < std::cos(kUpright);
}

bool goes_through(const std::vector<Eigen::Vector3d>& points, const Plane& other,
                  const SeenPlane& seen) {
  std::size_t over = 0, before = 0, behind = 0;
  for (const Eigen::Vector3d& p : points) {
    if (!seen.seen(p, 1, 0)) continue;
    ++over;
    const double d = other.signed_distance(p);
    before += d > kThrough;
    behind += d < -kThrough;
  }
  const auto share = [](std::size_t a, std::size_t b) {
    return static_cast<double>(a) / static_cast<double>(b);
  };
  return over > 0 && share(over, points.size()) >= kOver &&
         share(std::min(before, behind), over) >= kShare;
}

}  // namespace

std::set<PlaneId> ghosts(const Graph& graph, const Outlines& outlines) {
  std::set<PlaneId> found;
  for (const PlaneLandmark& plane : graph.planes) {
    const auto pieces = outlines.find(plane.id);
    if (!plane.active || pieces == outlines.end() || !upright(plane)) continue;
    const std::size_t views = keyframes_of(graph, pieces->second).size();
    if (views == 0 || views > kFew) continue;
    const auto points = seen_points(graph, pieces->second, kSpacing);
    if (points.empty()) continue;
    for (const PlaneLandmark& other : graph.planes) {
      const auto there = outlines.find(other.id);
      if (!other.active || other.id == plane.id || there == outlines.end() || !upright(other))
        continue;
      const double turned = angle_between(other.plane_anchor, plane.plane_anchor);
      if (turned < kTurned || turned > kAcross) continue;
      if (other.observations < kTimes * plane.observations) continue;
      if (!goes_through(points, other.plane_map(), SeenPlane(graph, other, there->second)))
        continue;
      found.insert(plane.id);
      break;
    }
  }
  return found;
}

}  // namespace lamina
