// A graph as a ceres::Problem: what the Ceres engine solves, and what a user builds on.
#pragma once

#include <memory>

#include <lamina/backend/solver/engine.hpp>

namespace ceres {
class Problem;
}

namespace lamina {

/// How many states of each kind a graph has.
struct SizesOfGraph {
  std::size_t keyframes = 0, planes = 0, surfels = 0, extrinsics = 0, custom = 0;
};

/// Owns the parameter blocks and the problem, which may be given more blocks and residuals. Blocks
/// (backend/graph/states.hpp): pose 7 (translation, quaternion x y z w), plane 4 (normal, rho about
/// its anchor), surfel 3, extrinsics 7 as a pose. Held states are constant blocks; factors that may
/// be wrong carry their weight as a loss, surfel parents a Cauchy kernel. Of Parts::kTurns: factors
/// and manifolds of what turns alone.
class CeresGraph {
 public:
  explicit CeresGraph(const Graph& graph, Parts parts = Parts::kAll);
  ~CeresGraph();
  CeresGraph(const CeresGraph&) = delete;
  CeresGraph& operator=(const CeresGraph&) = delete;

  ceres::Problem& problem();
  /// The block of a state by its place in the graph's vector.
  double* pose(std::size_t keyframe);
  double* plane(std::size_t plane);
  double* surfel(std::size_t surfel);
  double* extrinsics(std::size_t sensor);
  double* custom(std::size_t state);
  SizesOfGraph sizes() const;

  /// Tangent numbers of the blocks that are not constant.
  int dimension() const;
  CostByType cost() const;
  /// Factors of weight 0 at the beginning are not in the problem, and stay out.
  void set_weights(const RobustWeights& weights);
  /// Positions and distances alone move, or all again.
  void hold_turns(bool held);
  void read(const Graph& graph);
  void write(Graph& graph) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lamina
