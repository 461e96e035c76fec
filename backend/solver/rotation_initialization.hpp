// A start for graphs that have drifted too far to be linear: directions first, then positions.
#pragma once

#include <vector>

#include <lamina/backend/solver/engine.hpp>

namespace lamina {

/// A step that turns a keyframe by more than this, rad, is beyond what its linear model can tell:
/// positions along it bend as tangents do, off by half the square of the angle times their
/// distance.
inline constexpr double kLargestTurn = 1.0;

/// Where turns alone are asked first: they are gone on with from this on, rad. What they take is
/// less than what the whole system would.
inline constexpr double kTurnsPay = 0.3;
/// A step that turns a keyframe by less, rad, does not bend the path worth following it.
inline constexpr double kBends = 0.02;

/// What a solver moves.
struct GraphStates {
  std::vector<SE3> poses, sensors;
  std::vector<Plane> planes;
  std::vector<Eigen::Vector3d> surfels;
  std::vector<Eigen::VectorXd> custom;
};
GraphStates states_of(const Graph& graph);
/// Of the same graph: nothing was added or removed since.
void put_back(const GraphStates& states, Graph& graph);

struct RotationInitialization {
  int iterations = 0;  ///< linear systems solved
  bool far = false;    ///< the first step turned a keyframe by more than was asked for
};

/// Turns alone are a benign problem however long the path is: rotations between keyframes and tilts
/// of planes, solved from where they are by Gauss-Newton on the manifold (from nothing, as chordal
/// relaxation does, the solution fades along the path). With the turns held, positions and
/// distances are a linear problem: one system, surfels' heights among them. `all`: of the graph as
/// it is, turns by `engine`, `cost` its cost; both go on from the start, or are as they were when
/// the cost did not fall or the first step turned nothing by more than `least_turn` (rad).
RotationInitialization start_from_turns(Graph& graph, BatchEngine& all, SolverEngine engine,
                                        double cost, double least_turn = 0);

}  // namespace lamina
