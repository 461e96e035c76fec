// Beams of a scanner that end on the ground: where a ramp rises into its plane, or it looks down
// one.
#pragma once

#include <vector>

#include <lamina/models/planar_map.hpp>
#include <lamina/models/polygon.hpp>

namespace lamina::apps {

/// The ground of a map that has ramps: its floors, ramps and steps.
class GroundHits {
 public:
  /// A map without ramps has no ground for this.
  explicit GroundHits(const std::vector<MapPlane>& planes);
  bool empty() const { return areas_.empty(); }
  /// Whether a point (map frame, m) is on a piece of ground, to `near` (m).
  bool contains(const Eigen::Vector3d& p_map, double near) const;

 private:
  struct Area {
    SE3 T_plane_map;  // z: off the ground
    std::vector<Polygon> outlines;
  };
  std::vector<Area> areas_;
};

}  // namespace lamina::apps
