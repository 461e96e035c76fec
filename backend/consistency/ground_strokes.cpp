// Points along strokes against planes of the ground.
#include <lamina/backend/consistency/ground_strokes.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

constexpr double kNear = 0.05;            // m off the ground
constexpr double kHeightShare = 1.0 / 3;  // of the scanner's height
constexpr double kShare = 0.5;            // of the points
constexpr int kPoints = 5;                // a stroke

// A beam that meets the ground does not run along it.
bool on(const PlaneLandmark& ground, const Eigen::Vector3d& scanner_map,
        const Eigen::Vector3d& p_map, double near) {
  const auto off = [&ground](const Eigen::Vector3d& p) {
    return ground.plane_anchor.signed_distance(p - ground.anchor_map);
  };
  if (std::abs(off(p_map)) > near || std::abs(off(scanner_map)) < near) return false;
  return ground.outline.contains((ground.T_map_outline.inverse() * p_map).head<2>());
}

}  // namespace

bool lies_on_ground(const std::vector<OutlinePiece>& strokes, const Graph& graph,
                    const std::vector<const PlaneLandmark*>& ground) {
  int all = 0, grounded = 0;
  for (const OutlinePiece& stroke : strokes) {
    const Keyframe* keyframe = graph.find(stroke.keyframe);
    if (!keyframe || stroke.points_body.size() != 2) continue;
    const Eigen::Vector3d &a = stroke.points_body[0], &b = stroke.points_body[1];
    for (int k = 0; k < kPoints; ++k) {
      const Eigen::Vector3d p = a + (k + 0.5) / kPoints * (b - a);
      const double near = std::min(kNear, kHeightShare * p.z());
      const Eigen::Vector3d p_map = keyframe->T_map_body * p;
      const Eigen::Vector3d from = keyframe->T_map_body * Eigen::Vector3d(0, 0, p.z());
      ++all;
      grounded += std::any_of(ground.begin(), ground.end(), [&](const PlaneLandmark* plane) {
        return on(*plane, from, p_map, near);
      });
    }
  }
  return all > 0 && grounded >= kShare * all;
}

}  // namespace lamina
