// The nearest two points, and how far each set goes along the way between them.
#include <lamina/backend/association/outline_gap.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace lamina {
namespace {

constexpr double kSurelyOne = 0.5;  // m: between coplanar pieces of any size
constexpr double kLevel = 0.25;     // m, from the lowest to the highest point, cells and all

double extent(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& direction) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& p : points) {
    low = std::min(low, direction.dot(p));
    high = std::max(high, direction.dot(p));
  }
  return high - low;
}

Eigen::AlignedBox3d box_of(std::span<const Eigen::Vector3d> points) {
  Eigen::AlignedBox3d box;
  for (const auto& p : points) box.extend(p);
  return box;
}

// The points within `reach` (m) of a box, heights times `heights`.
std::vector<Eigen::Vector3d> within(std::span<const Eigen::Vector3d> points,
                                    const Eigen::AlignedBox3d& box, double heights, double reach) {
  std::vector<Eigen::Vector3d> near;
  std::copy_if(points.begin(), points.end(), std::back_inserter(near),
               [&](const Eigen::Vector3d& p) {
                 const Eigen::Vector3d off = (box.min() - p).cwiseMax(p - box.max()).cwiseMax(0.0);
                 return off.cwiseProduct(Eigen::Vector3d(1, 1, heights)).norm() <= reach;
               });
  return near;
}

}  // namespace

bool beside(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b, double most) {
  // Strokes of level scans tell nothing of how high a surface reaches.
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const bool stroke_a = extent(a, up) < kLevel, stroke_b = extent(b, up) < kLevel;
  const double heights = stroke_a || stroke_b ? 0 : 1;
  if (a.empty() || b.empty()) return false;
  const double reach = std::max(kSurelyOne, most);
  const auto near_a = within(a, box_of(b), heights, reach);
  if (near_a.empty()) return false;
  const auto near_b = within(b, box_of(near_a), heights, reach);
  double least = std::numeric_limits<double>::infinity();
  Eigen::Vector3d across = Eigen::Vector3d::Zero();
  for (const auto& p : near_a) {
    for (const auto& q : near_b) {
      const Eigen::Vector3d way = (q - p).cwiseProduct(Eigen::Vector3d(1, 1, heights));
      const double squared = way.squaredNorm();
      if (squared >= least) continue;
      least = squared;
      across = way;
      if (squared <= kSurelyOne * kSurelyOne) return true;
    }
  }
  const double gap = std::sqrt(least);
  if (!(gap <= most)) return false;
  const double one = extent(a, across / gap), other = extent(b, across / gap);
  return gap <= (stroke_a == stroke_b ? std::min(one, other) : 0.5 * (one + other));
}

std::vector<Eigen::Vector3d> seen_points_map(const PlaneLandmark& plane) {
  std::vector<Eigen::Vector3d> points;
  const double cell = plane.outline.cell_size();
  for (const auto& [i, j] : plane.outline.cells())
    points.push_back(plane.T_map_outline * Eigen::Vector3d((i + 0.5) * cell, (j + 0.5) * cell, 0));
  return points;
}

bool falls_on(const PlaneLandmark& plane, std::span<const Eigen::Vector3d> points_map) {
  const SE3 T_outline_map = plane.T_map_outline.inverse();
  return std::any_of(points_map.begin(), points_map.end(), [&](const Eigen::Vector3d& p) {
    return plane.outline.contains((T_outline_map * p).head<2>());
  });
}

}  // namespace lamina
