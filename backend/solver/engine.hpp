// A solver of a whole graph: the own block Cholesky or Ceres, behind one interface.
#pragma once

#include <array>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

enum class SolverEngine {
  kNative,  ///< block Cholesky of the normal equations (CHOLMOD), Levenberg-Marquardt of this
            ///< library
  kCeres    ///< ceres::Problem, its trust region, SuiteSparse
};
const char* to_string(SolverEngine engine);

/// Which states are moved, by which residuals.
enum class Parts {
  kAll,
  /// Directions alone (rotations between keyframes, tilts of planes), which do not ask where
  /// anything is: only what turns is a variable, and surfels are left out, sensors
  /// held.
  kTurns
};

/// One number for each factor that may be doubted, in the graph's order: a weight, or chi-squared.
struct RobustWeights {
  std::vector<double> plane_moments, segments, loops;
  std::vector<double> custom;  ///< chi-squared 0 of those that may not be wrong
};

/// Chi-squared of every doubtful factor at the graph's states, its weight left aside.
RobustWeights chi_squared_of(const Graph& graph);

/// Sum of weighted squared residuals by FactorType.
using CostByType = std::array<double, kFactorTypes>;
double total(const CostByType& cost);

enum class SolveStatus {
  kConverged,       ///< the last step changed chi-squared by less than the tolerance
  kMaxIterations,   ///< stopped before that
  kStalled,         ///< no step lowers the cost, though the gradient says one should
  kCancelled,       ///< the progress callback said stop
  kNothingToSolve,  ///< no free state, or no factor
  kInvalidInput     ///< Graph::problems() is not empty; nothing was changed
};
const char* to_string(SolveStatus status);

struct MinimizerOptions {
  int max_iterations = 50;  ///< linear systems solved
  int max_steps = 1000;     ///< of them, steps that lowered the cost
  /// Stop when a step is predicted to lower chi-squared by less: absolute, because the cost's size
  /// says nothing about how far the states are from their best. 1e-2 is 0.1 sigma in all, and that
  /// last step is still taken.
  double chi2_tolerance = 1e-2;
  /// The same relative to chi-squared, whichever is larger. A step's predicted decrease is its
  /// length in sigmas, squared; a good solution's chi-squared is the number of its redundant
  /// measurements. So 1e-6 is a step of a thousandth of a sigma for each of them.
  double relative_tolerance = 1e-6;
  /// Relative to the diagonal. So small that a step is Gauss-Newton's wherever the graph is
  /// determined, and directions that nothing constrains still stay put.
  double initial_damping = 1e-14;
  double max_damping = 1e4;
  /// Stop (kStalled) after so many steps that raised the cost, all told.
  int max_rejections = 1000;
};

/// For paths so long that they may be off by radians.
struct LongPath {
  /// Stop before the first step (turns_too_far) when it would turn a keyframe by more, rad.
  double largest_first_turn = std::numeric_limits<double>::infinity();
  /// After a step that turns a keyframe by more than this (rad) and lowers the cost by little of
  /// what it promised: positions follow. Turns of hundredths bend no path. (Native engine alone:
  /// Ceres' trust region shrinks instead.)
  double follow_from_turn = std::numeric_limits<double>::infinity();
};

struct Iteration {
  int number = 0;  ///< from 1
  double cost = 0;
  double predicted_decrease = 0;
  double damping = 0;
  bool accepted = false;
  double largest_turn = 0;  ///< of a keyframe by the step, rad
};

struct MinimizerResult {
  SolveStatus status = SolveStatus::kNothingToSolve;
  int iterations = 0;          ///< linear systems solved
  bool turns_too_far = false;  ///< see LongPath; the states are as they were
  CostByType initial_cost{}, final_cost{};
};

/// Called after each iteration; returning false stops.
using IterationCallback = std::function<bool(const Iteration&)>;

/// States and factors of one graph, taken in once. Factors of weight 0 are left out. Held states
/// (fixed keyframes and planes, inactive planes) do not move.
class BatchEngine {
 public:
  virtual ~BatchEngine() = default;

  /// Columns: 6 a free pose or sensor, 3 a free plane, surfel, custom states as they say; of turns
  /// 3 a pose, 2 a plane.
  virtual int dimension() const = 0;
  virtual CostByType cost() const = 0;
  /// Of every doubtful factor, its weight left aside; 0 for those left out.
  virtual RobustWeights chi_squared() const = 0;
  /// New weights for the factors that were taken in.
  virtual void set_weights(const RobustWeights& weights) = 0;
  /// Moves the states to the nearest minimum. Never throws for numerical reasons, never leaves NaN
  /// behind.
  virtual MinimizerResult minimize(const MinimizerOptions& options,
                                   const IterationCallback& progress = {},
                                   const LongPath& path = {}) = 0;
  /// Turns stay as they are, positions and distances go where they fit best: a linear problem. A
  /// step that turns a long path moves its positions along tangents; that stretches every link by
  /// half the square of the turn, and the cost goes up although the turns are right. False when the
  /// system could not be solved.
  virtual bool let_positions_follow() = 0;
  /// Directions that nothing constrains, as the present states have it.
  virtual int rank_deficiency() = 0;

  /// Takes the states of the graph this was made from, and nothing else.
  virtual void read(const Graph& graph) = 0;
  /// Writes poses, planes, surfels, extrinsics into the graph this was made from.
  virtual void write(Graph& graph) const = 0;
  /// How linear systems are solved, and why.
  virtual std::string description() const = 0;
};

std::unique_ptr<BatchEngine> make_engine(const Graph& graph, SolverEngine engine,
                                         Parts parts = Parts::kAll);

}  // namespace lamina
