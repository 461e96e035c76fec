// Benchmark problems for the solver: text files of poses, planes and moments with known truth.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string_view>
#include <vector>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

/// One .planegraph file. Records, one a line (`#` comments allowed):
///   SIG sigma_t sigma_r sigma_p; GT / INIT i qx qy qz qw tx ty tz; PLANE j nx ny nz d;
///   ODO i j qx qy qz qw tx ty tz; OBS i j s00 s01 s02 s03 s11 s12 s13 s22 s23 s33.
struct PlaneGraph {
  double sigma_translation = 0.01;  ///< m per odometry step
  double sigma_rotation = 0.002;    ///< rad per odometry step
  double sigma_point = 0.01;        ///< m, point noise along the plane's normal

  std::vector<SE3> truth_map_body;    ///< scoring only; empty when the file has no GT
  std::vector<SE3> initial_map_body;  ///< first guess
  std::vector<Plane> truth_planes;    ///< scoring only; empty when the file has no PLANE
  struct Odometry {
    int from = 0, to = 0;
    SE3 T_from_to;
  };
  std::vector<Odometry> odometry;
  struct Observation {
    int pose = 0, plane = 0;
    Moments moments_body;  ///< unit weights
  };
  std::vector<Observation> observations;
  int plane_count = 0;  ///< 1 + the largest plane index
};

/// Reads a file; throws lamina::Error "FILE:LINE: found ..., expected ...".
PlaneGraph read_plane_graph(const std::filesystem::path& file);
/// The same from text; `name` stands in for the file in errors.
PlaneGraph parse_plane_graph(std::string_view text, const std::string& name);
void write_plane_graph(const PlaneGraph& problem, const std::filesystem::path& file);

}  // namespace lamina
