// Beams of a scanner that end on the ground: where a ramp rises into its plane, or it looks down
// one.
#pragma once

#include <optional>
#include <vector>

#include <lamina/models/planar_map.hpp>
#include <lamina/models/polygon.hpp>

namespace lamina {

/// The ground of a map that has ramps: its floors, ramps and steps.
class GroundHits {
 public:
  enum class Of { kMapsWithRamps, kAnyMap };
  /// A map without ramps has no ground for beams that should not meet it.
  explicit GroundHits(const std::vector<MapPlane>& planes, Of of = Of::kMapsWithRamps);
  bool empty() const { return areas_.empty(); }
  /// Whether a beam (map frame, m) ends on a piece of ground, to `near` (m), that it does not run
  /// along.
  bool ends_on(const Eigen::Vector3d& from_map, const Eigen::Vector3d& end_map, double near) const;
  /// Map z (m) of the ground under a point, or that the point is a little below; nullopt where none
  /// was seen.
  std::optional<double> under(const Eigen::Vector3d& p_map) const;
  /// Map z (m) of the ground nearest above or below a point, to `near` (m).
  std::optional<double> nearest(const Eigen::Vector3d& p_map, double near) const;

 private:
  struct Area {
    Plane plane_map;
    SE3 T_plane_map;  // z: off the ground
    bool holds(const Eigen::Vector3d& p_plane) const;
    /// Map z of the plane above or below a point, wherever its outline.
    double height_at(const Eigen::Vector3d& p_map) const {
      const Eigen::Vector3d& n = plane_map.normal();
      return (plane_map.rho() - n.head<2>().dot(p_map.head<2>())) / n.z();
    }
    std::vector<Polygon> outlines;
  };
  std::vector<Area> areas_;
};

}  // namespace lamina
