// The result: planes, floor, edges and path, in the map frame. What grids and files are made from.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include <lamina/models/plane.hpp>
#include <lamina/models/surfel.hpp>
#include <lamina/models/timestamp.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {

enum class PlaneLabel { kFloor, kRamp, kStep, kWall, kCeiling, kOther };
/// "floor", "ramp", "step", "wall", "ceiling", "other".
inline const char* to_string(PlaneLabel label) {
  constexpr const char* kNames[] = {"floor", "ramp", "step", "wall", "ceiling", "other"};
  return kNames[static_cast<int>(label)];
}

struct MapPlane {
  std::int64_t id = 0;
  PlaneLabel label = PlaneLabel::kOther;
  Plane plane_map;
  Eigen::Vector3d centroid_map = Eigen::Vector3d::Zero();
  /// Of plane_map.about(centroid_map) in Plane's tangent (tilt, tilt, rho).
  /// Of measurements, sensors sitting where they are said to.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  /// Added by what is unknown of where sensors sit on the body; all planes move by it as one.
  Eigen::Matrix3d covariance_mounting = Eigen::Matrix3d::Zero();
  std::vector<std::vector<Eigen::Vector3d>> outlines_map;  ///< closed, on the plane; largest first
  std::vector<Eigen::Vector3d> ring_map;  ///< one round all of them; strips join what lies apart
  double area = 0;                        ///< m^2
  std::int64_t observations = 0;
  Timestamp first_seen, last_seen;
  int unobserved_directions = 0;  ///< of 3: how many directions no measurement constrains
};

/// A point where floor ends: the rim of a hole, a ledge with nothing behind, the end of knowledge.
struct EdgePoint {
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  double sigma = 0;      ///< m, horizontal
  bool negative = true;  ///< true: the ground falls away; false: knowledge ends
};

struct PlanarMap {
  std::vector<MapPlane> planes;
  std::vector<Surfel> surfels;  ///< floor surfels, map frame
  std::vector<EdgePoint> edges;
  std::vector<Eigen::Vector3d> loose_points;  ///< obstacle points that belong to no plane
  Trajectory trajectory;                      ///< T_map_body at every processed frame and scan
};

}  // namespace lamina
