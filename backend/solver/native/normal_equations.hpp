// The graph as Gauss-Newton sees it: states, terms, and J^T J assembled in place.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <utility>
#include <vector>

#include <lamina/backend/solver/engine.hpp>

namespace lamina {

/// Owns copies of the states and the factors' constants; the Graph is read once and written once.
/// Variables that no solver moves (fixed keyframes and planes, inactive planes) have no columns;
/// factors of weight 0 are left out, so that wrong ones cost no fill.
class NormalEquations {
 public:
  explicit NormalEquations(const Graph& graph, Parts parts = Parts::kAll);
  ~NormalEquations();
  NormalEquations(const NormalEquations&) = delete;
  NormalEquations& operator=(const NormalEquations&) = delete;

  /// Columns: 6 a free pose or sensor, 3 a free plane, surfel; of turns 3 a pose, 2 a plane.
  int dimension() const;
  /// New weights for the factors that were taken in.
  void set_weights(const RobustWeights& weights);
  /// Assembles J^T J and J^T r at the current states; returns the cost by type.
  CostByType linearize();
  CostByType cost() const;
  /// Chi-squared of every doubtful factor, its weight left aside; 0 for those left out.
  RobustWeights chi_squared() const;

  const Eigen::VectorXd& gradient() const;  ///< J^T r
  Eigen::VectorXd diagonal() const;
  bool factorize(const Eigen::VectorXd& added);
  Eigen::VectorXd solve(const Eigen::VectorXd& rhs);
  int weak_pivots(double threshold) const;

  /// Moves all states by d, and back again. `further`: on top of the last step; undo_step() then
  /// takes back both.
  void step(const Eigen::VectorXd& d, bool further = false);
  void undo_step();
  /// 1 for every column that turns something (rotations of poses, tilts of planes, angles of
  /// sensors), 0 for the others: with the turns held, what is left is a linear problem in them.
  Eigen::VectorXd turning() const;
  /// The largest angle by which the step d turns a pose, rad.
  double largest_turn(const Eigen::VectorXd& d) const;

  /// Takes the states of the graph this was made from, and nothing else.
  void read(const Graph& graph);
  /// Writes poses, planes, surfels, extrinsics into the graph this was made from.
  void write(Graph& graph) const;

  /// Blocks of the inverse of what was factored last, by index into the graph's vectors; zero for
  /// states that are held.
  std::vector<Matrix6d> pose_covariances(const std::vector<std::size_t>& indices);
  std::vector<Eigen::Matrix3d> plane_covariances(const std::vector<std::size_t>& indices);
  std::vector<Eigen::Matrix3d> surfel_covariances(const std::vector<std::size_t>& indices);
  /// Joint covariance of poses, or of sensors, cross terms included.
  Eigen::MatrixXd joint_pose_covariance(const std::vector<std::size_t>& indices);
  Eigen::MatrixXd joint_extrinsics_covariance(const std::vector<std::size_t>& indices);
  /// Joint covariances of pairs of planes, each about the graph's anchor: (tilt, tilt, rho) of the
  /// one, then of the other.
  std::vector<Matrix6d> plane_pair_covariances(
      const std::vector<std::pair<std::size_t, std::size_t>>& pairs);

  double factor_entries() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lamina
