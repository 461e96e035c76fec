// Benchmark problems through the refiner: one function, and the scores.
#pragma once

#include <lamina/backend/refine/refiner.hpp>
#include <lamina/pipeline/evaluation/plane_graph.hpp>

namespace lamina {

struct PlaneGraphResult {
  RefineResult refine;
  Graph graph;                  ///< keyframe i is pose i, plane j is plane j
  double ate_m = -1;            ///< rms position error without alignment; -1: no truth
  double plane_angle_deg = -1;  ///< mean angle to the true planes; -1: no truth
};

/// The problem as a graph at its first guess: pose 0 fixed, observations weighted by sigma_point
/// and freed of their constant, planes fitted to their first observation.
Graph make_graph(const PlaneGraph& problem);

/// Refines it. `refine.solve_s` counts from the read problem to the solution.
PlaneGraphResult solve_plane_graph(const PlaneGraph& problem, const RefineOptions& options = {},
                                   const std::function<bool(const RefineProgress&)>& progress = {});

/// rms distance of positions, no alignment; -1 without truth.
double position_rmse(const Graph& graph, const std::vector<SE3>& truth);
/// Mean angle in degrees between planes that were observed and their truth; -1 without truth.
double mean_plane_angle_deg(const Graph& graph, const std::vector<Plane>& truth);

}  // namespace lamina
