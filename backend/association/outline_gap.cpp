// The nearest two points, and how far each set goes along the way between them.
#include <lamina/backend/association/outline_gap.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
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

// A lower bound of the gap between two sets: that between their boxes, heights times `heights`.
double box_gap(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b,
               double heights) {
  Eigen::AlignedBox3d box_a, box_b;
  for (const auto& p : a) box_a.extend(p);
  for (const auto& p : b) box_b.extend(p);
  const Eigen::Vector3d gap =
      (box_a.min() - box_b.max()).cwiseMax(box_b.min() - box_a.max()).cwiseMax(0.0);
  return gap.cwiseProduct(Eigen::Vector3d(1, 1, heights)).norm();
}

}  // namespace

bool beside(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b, double most) {
  // Strokes of level scans tell nothing of how high a surface reaches.
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const bool stroke_a = extent(a, up) < kLevel, stroke_b = extent(b, up) < kLevel;
  const double heights = stroke_a || stroke_b ? 0 : 1;
  if (box_gap(a, b, heights) > std::max(kSurelyOne, most)) return false;
  double least = std::numeric_limits<double>::infinity();
  Eigen::Vector3d across = Eigen::Vector3d::Zero();
  for (const auto& p : a) {
    for (const auto& q : b) {
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
