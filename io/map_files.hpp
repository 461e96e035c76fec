// trajectory.txt and planes.json: the map as other tools read it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <lamina/models/planar_map.hpp>

namespace lamina::io {

/// TUM lines, T_map_body at every processed depth frame and scan.
void write_trajectory(const std::filesystem::path& file, const Trajectory& trajectory);

/// 1-sigma of a plane at its centroid: distance (m), and the larger of the two tilts (rad), which a
/// reader may rely on whatever the direction.
struct PlaneSigmas {
  double rho = 0, angle = 0;
};
PlaneSigmas plane_sigmas(const MapPlane& plane);
/// Of (tilt, tilt, rho) alone.
PlaneSigmas plane_sigmas(const Eigen::Matrix3d& covariance);

/// docs/formats.md: id, label, normal, rho, theta, phi, sigmas at the centroid, boundary (the
/// largest outline), area, observations, first and last time seen; and, as additions, the centroid,
/// all outlines where there are several, and the number of directions nothing has measured.
void write_planes_json(const std::filesystem::path& file, const std::vector<MapPlane>& planes);
/// Reads it back; throws lamina::Error naming the file and what is wrong.
std::vector<MapPlane> read_planes_json(const std::filesystem::path& file);

}  // namespace lamina::io
