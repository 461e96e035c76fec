// The fixed-lag window alone on a benchmark problem with given associations.
#pragma once

#include <vector>

#include <lamina/backend/solver/window/sliding_window.hpp>
#include <lamina/pipeline/evaluation/plane_graph.hpp>

namespace lamina {

struct WindowRun {
  std::vector<SE3>
      T_map_body;  ///< by pose index: as it left the window (the last ones: at the end)
  std::vector<SE3> T_map_newest;  ///< by pose index: as it was when it was the newest
  /// By pose index: of the newest pose in its right tangent; empty unless asked for.
  std::vector<Matrix6d> newest_covariance;
  /// A plane as it left the window, unless covariances were not asked for.
  struct Departed {
    int plane = 0;
    Eigen::Vector3d anchor_map;
    Plane plane_anchor;
    Eigen::Matrix3d covariance;  ///< in plane_anchor's boxplus tangent
  };
  std::vector<Departed> departed;
  std::vector<double> step_ms;  ///< by pose index: add, solve and marginalise
  int iterations = 0;           ///< of all steps
  bool finite = true;           ///< false: some step met a number that was not finite
};

/// Every pose is a keyframe; it starts from its odometry, planes from their first sighting. Planes
/// that come back after they left the window are tied to what they were.
WindowRun run_window_on_plane_graph(const PlaneGraph& problem, const WindowOptions& options,
                                    bool with_covariance = false);

}  // namespace lamina
