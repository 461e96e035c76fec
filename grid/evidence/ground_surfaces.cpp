// Points against outlines of ground planes.
#include <lamina/grid/evidence/ground_surfaces.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {

GroundHits::GroundHits(const std::vector<MapPlane>& planes, Of of) {
  const bool ramps = std::any_of(planes.begin(), planes.end(),
                                 [](const MapPlane& p) { return p.label == PlaneLabel::kRamp; });
  if (!ramps && of == Of::kMapsWithRamps) return;
  for (const MapPlane& plane : planes) {
    if (plane.label != PlaneLabel::kRamp && plane.label != PlaneLabel::kFloor &&
        plane.label != PlaneLabel::kStep)
      continue;
    Area area{plane.plane_map, plane_frame(plane.plane_map, plane.centroid_map).inverse(), {}};
    for (const auto& outline : plane.outlines_map) {
      std::vector<Eigen::Vector2d> flat;
      for (const Eigen::Vector3d& p : outline) flat.push_back((area.T_plane_map * p).head<2>());
      if (auto polygon = Polygon::from_vertices(std::move(flat)))
        area.outlines.push_back(std::move(*polygon));
    }
    areas_.push_back(std::move(area));
  }
}

bool GroundHits::Area::holds(const Eigen::Vector3d& p_plane) const {
  return std::any_of(outlines.begin(), outlines.end(),
                     [&](const Polygon& outline) { return outline.contains(p_plane.head<2>()); });
}

bool GroundHits::ends_on(const Eigen::Vector3d& from_map, const Eigen::Vector3d& end_map,
                         double near) const {
  return std::any_of(areas_.begin(), areas_.end(), [&](const Area& area) {
    const Eigen::Vector3d p = area.T_plane_map * end_map;
    return std::abs(p.z()) < near && std::abs(area.plane_map.signed_distance(from_map)) > near &&
           area.holds(p);
  });
}

std::optional<double> GroundHits::under(const Eigen::Vector3d& p_map) const {
  constexpr double kBelow = 0.1;  // m: what noise and the edges of ramps put under the ground
  std::optional<double> highest;
  for (const Area& area : areas_) {
    const double z = area.height_at(p_map);
    if (!(z < p_map.z() + kBelow) || (highest && z <= *highest)) continue;
    if (area.holds(area.T_plane_map * Eigen::Vector3d(p_map.x(), p_map.y(), z))) highest = z;
  }
  return highest;
}

std::optional<double> GroundHits::nearest(const Eigen::Vector3d& p_map, double near) const {
  std::optional<double> found;
  for (const Area& area : areas_) {
    const double z = area.height_at(p_map), off = std::abs(z - p_map.z());
    if (!(off < near)) continue;
    if (!area.holds(area.T_plane_map * Eigen::Vector3d(p_map.x(), p_map.y(), z))) continue;
    found = z;
    near = off;
  }
  return found;
}

}  // namespace lamina
