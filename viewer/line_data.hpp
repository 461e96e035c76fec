// What stands line by line in a map's text files: keyframes, scans, edges.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include <lamina/models/trajectory.hpp>

namespace lamina::viewer {

/// T_map_body of every VERTEX_SE3:QUAT of a g2o file, in its order. Other lines are passed over.
std::vector<SE3> keyframes_of(const std::filesystem::path& g2o_file);

/// Where the beams of scans.csv (body frame) ended, in the map frame, each scan laid at its place
/// on the path; one point for each PointCloud cell. Scans outside the path's time are left out.
std::vector<Eigen::Vector3f> scan_points(const std::filesystem::path& csv_file,
                                         const Trajectory& path);

/// The x,y,z of edges.csv: where floor ends.
std::vector<Eigen::Vector3f> edge_points(const std::filesystem::path& csv_file);

/// The window at each keyframe: columns of window.csv.
struct WindowSeries {
  std::vector<double> times;  ///< s, as in the recording
  std::vector<double> keyframes, residuals, solve_ms;
};
WindowSeries window_series(const std::filesystem::path& csv_file);

}  // namespace lamina::viewer
