// Planes of a map against true planes: matched, missed, split, merged, spurious.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <lamina/models/planar_map.hpp>

namespace lamina {

/// A plane as it truly is, in the reference frame.
struct ReferencePlane {
  std::int64_t id = 0;
  Plane plane;
  std::vector<Eigen::Vector3d> outline;  ///< closed
  std::int64_t hits = 0;                 ///< measurements that fell on it
};

struct PlaneMatch {
  std::int64_t reference_id = 0, map_id = 0;
  double rho_error_m = 0;  ///< at the map plane's centroid
  double angle_error_deg = 0;
  double normalized_squared = 0;  ///< (tilt, tilt, rho) by the map's own covariance, 3 dof
};

struct PlaneErrors {
  std::vector<PlaneMatch> matches;     ///< the best map plane of each reference plane found
  std::vector<std::int64_t> missed;    ///< reference ids no map plane lies on
  std::vector<std::int64_t> split;     ///< reference ids with more than one map plane
  std::vector<std::int64_t> merged;    ///< map ids that lie on more than one wall
  std::vector<std::int64_t> spurious;  ///< map ids that lie on none
  double rho_mean_m = 0, rho_max_m = 0, angle_mean_deg = 0, angle_max_deg = 0;
};

struct PlaneMatchOptions {
  std::int64_t min_hits = 50;  ///< reference planes seen less are not asked for
  double max_angle = 0.6;      ///< rad, between normals of a match
  double max_distance = 1.0;   ///< m, of a point of the map plane from the reference plane
  /// A map plane lies on a reference when this share of it does, or what does is this long compared
  /// with the reference, in plan. A point that several references hold counts for the nearest.
  double min_overlap = 0.3;
  double min_length = 0.5;
  double border = 0.25;  ///< m, by which reference outlines are grown in that test
  /// References in one plane with gaps like doors are one wall: to map it as one is no mistake.
  double door = 1.5;                ///< m
  double coplanar_distance = 1e-3;  ///< m
  double coplanar_angle = 1e-3;     ///< rad
};

/// Pairs of map planes that look like one wall drawn twice, no truth needed: seen from one side,
/// normals within `max_angle` (rad), less than `max_distance` (m) apart, and this share of one of
/// them lies before the other's outline. Slabs, frames and shelves are such pairs, too: of a world
/// without them it counts doubles.
struct NearOptions {
  double max_angle = 0.035, max_distance = 0.3, min_overlap = 0.3;
  double border = 0.1;  ///< m, by which outlines are grown: a scan's are strokes
};
std::vector<std::pair<std::int64_t, std::int64_t>> near_pairs(const std::vector<MapPlane>& planes,
                                                              const NearOptions& options = {});

/// `planes` are moved by T_reference_map first; to see what their covariances hold, by
/// T_reference_datum (nullopt: the same), which makes the map's first pose the true one: they are
/// covariances against that.
PlaneErrors plane_errors(const std::vector<MapPlane>& planes,
                         const std::vector<ReferencePlane>& reference, const SE3& T_reference_map,
                         const PlaneMatchOptions& options = {},
                         const std::optional<SE3>& T_reference_datum = {});

}  // namespace lamina
