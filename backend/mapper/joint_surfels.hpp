// Floors that are no planes in the joint estimate: a surfel a cell, seen from many keyframes, with
// the floor's plane as its prior.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/mapper/surfel_estimator.hpp>

namespace lamina {

struct JointSurfelOptions {
  /// Surfels of rough floors are estimated together with poses and planes; false: after them.
  bool enabled = true;
  double cell_m = 0.25;  ///< side: a swell of 2 cm over 2 m is straight over it to a millimetre
  /// A floor whose cells lie off its plane by less is a plane: its moments say all there is. Walls
  /// and floors that are built plane deviate by 1 to 3 mm.
  double least_roughness_m = 0.004;
  /// What the points of one view share (m, 1-sigma): however many cells it shows, it does not say
  /// better than this where the body is above them.
  double view_sigma_m = 0.002;
  /// Heights of ground go together over so much (m): cells nearer to each other count as one where
  /// the plane holds them.
  double correlation_m = 0.7;
  /// The window takes every so many-th cell each way: all that a view shows together says no better
  /// than view_sigma_m where the body is, and fewer cells say as much.
  int window_every = 2;
  double slope_sigma = 0.05;   ///< slope off the plane, m per m
  std::size_t min_cells = 20;  ///< fewer say nothing of a floor's roughness
  double level_gap_m = 0.15;   ///< evidence further than this from a floor (m) is not of it

  std::vector<std::string> problems() const;
};

/// Root mean square of how far cells of floor lie off the best plane of each view by itself (m; a
/// pose that is off makes no floor rough), for every active plane of ground with `min_cells`.
std::map<PlaneId, double> floor_roughness(const Graph& graph, const SurfelEvidence& evidence,
                                          const JointSurfelOptions& options);

/// Adds surfels of every floor rougher than `least_roughness_m`, the moments of what keyframes saw
/// of them, and their parents, at the poses of now. A view's moments weigh together no more than
/// view_sigma_m allows; parents' sigmas are the roughness, widened by how many cells go together.
/// Cells seen from one keyframe alone say nothing of poses but by their plane, and are kept.
/// Returns how many surfels there are; 0: the graph is as it was.
std::size_t add_joint_surfels(Graph& graph, const SurfelEvidence& evidence,
                              const JointSurfelOptions& options);

/// Takes all surfels and their factors out.
void remove_surfels(Graph& graph);

}  // namespace lamina
