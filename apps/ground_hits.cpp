// Points against outlines of ground planes.
#include <lamina/apps/ground_hits.hpp>

#include <algorithm>
#include <cmath>

namespace lamina::apps {

GroundHits::GroundHits(const std::vector<MapPlane>& planes) {
  const bool ramps = std::any_of(planes.begin(), planes.end(),
                                 [](const MapPlane& p) { return p.label == PlaneLabel::kRamp; });
  if (!ramps) return;
  for (const MapPlane& plane : planes) {
    if (plane.label != PlaneLabel::kRamp && plane.label != PlaneLabel::kFloor &&
        plane.label != PlaneLabel::kStep)
      continue;
    Area area{plane_frame(plane.plane_map, plane.centroid_map).inverse(), {}};
    for (const auto& outline : plane.outlines_map) {
      std::vector<Eigen::Vector2d> flat;
      for (const Eigen::Vector3d& p : outline) flat.push_back((area.T_plane_map * p).head<2>());
      if (auto polygon = Polygon::from_vertices(std::move(flat)))
        area.outlines.push_back(std::move(*polygon));
    }
    areas_.push_back(std::move(area));
  }
}

bool GroundHits::contains(const Eigen::Vector3d& p_map, double near) const {
  return std::any_of(areas_.begin(), areas_.end(), [&](const Area& area) {
    const Eigen::Vector3d p = area.T_plane_map * p_map;
    return std::abs(p.z()) < near &&
           std::any_of(area.outlines.begin(), area.outlines.end(),
                       [&](const Polygon& outline) { return outline.contains(p.head<2>()); });
  });
}

}  // namespace lamina::apps
