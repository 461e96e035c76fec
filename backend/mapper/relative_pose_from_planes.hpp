// Where one keyframe lies from another by the planes both have seen.
#pragma once

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

struct SharedPlanesOptions {
  /// What is believed of the guess, 1-sigma: directions that the planes leave open stay as guessed.
  double prior_m = 0.05;
  double prior_deg = 1;
};

struct SharedPose {
  SE3 T_a_b;
  /// Of the planes alone, in the tangent of T_a_b exp(x), x = (m, rad): zero where they tell
  /// nothing.
  Matrix6d information = Matrix6d::Zero();
  double chi_squared = 0;  ///< the worst plane's: what the two say of it against each other
  int planes = 0;
};

/// The pose of b in a that makes planes both keyframes have seen the same planes. Their moments
/// alone are asked, each plane being eliminated; where the graph's planes and poses are matters to
/// the guess alone, so drift that is not yet spread over the path does no harm.
SharedPose pose_by_shared_planes(const Graph& graph, KeyframeId a, KeyframeId b, const SE3& guess,
                                 const SharedPlanesOptions& options = {});

/// The planes alone tell where b lies on the floor, any way along it, better than a guess does.
bool tells_place(const SharedPose& pose, const SharedPlanesOptions& options = {});

}  // namespace lamina
