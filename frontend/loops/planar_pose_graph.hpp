// A small pose graph in the plane: what the loop closer believes while it looks for loops.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include <lamina/frontend/motion/planar.hpp>

namespace lamina {

/// A measured relative pose; information in its right tangent (x, y, yaw).
struct PlanarEdge {
  int from = 0, to = 0;
  PlanarPose T_from_to;
  Eigen::Matrix3d information = Eigen::Matrix3d::Identity();
  bool robust = false;  ///< a loop: weighed down when it contradicts the rest (Cauchy)
};

template <class A>
void fields(A& a, PlanarEdge& v) {
  a(v.from, v.to, v.T_from_to, v.information, v.robust);
}

/// Gauss-Newton over planar poses; node 0 is fixed. Every node must hang on node 0 by edges, but
/// for those that were removed.
class PlanarPoseGraph {
 public:
  PlanarPoseGraph();
  ~PlanarPoseGraph();
  PlanarPoseGraph(PlanarPoseGraph&&) noexcept;
  PlanarPoseGraph& operator=(PlanarPoseGraph&&) noexcept;

  int add_node(const PlanarPose& T_map_node);
  void add_edge(const PlanarEdge& edge) { edges_.push_back(edge); }
  void remove_last_edge() { edges_.pop_back(); }
  /// With its edges; its pose stays as it is and tells nothing. Not node 0.
  void remove_node(int node);

  std::size_t size() const { return poses_.size(); }
  /// Nodes that are neither fixed nor removed.
  int estimated() const { return unknowns().count; }
  const PlanarPose& pose(int node) const { return poses_[static_cast<std::size_t>(node)]; }
  const std::vector<PlanarEdge>& edges() const { return edges_; }
  std::vector<PlanarPose>& poses() { return poses_; }

  /// At most `iterations` steps; true when the last moved nothing by more than 1e-5 (m, rad).
  bool optimise(int iterations = 15);
  /// Squared Mahalanobis length of an edge's residual (3 degrees of freedom).
  double chi_squared(const PlanarEdge& edge) const;
  /// Of an edge in the graph as it is: 1, and less for a robust one that contradicts the rest.
  double weight(const PlanarEdge& edge) const;
  /// Covariance of T_from_to in its right tangent, by the graph as it is (linearised now).
  /// All `from` against one `to`: one factorisation for many questions.
  std::vector<Eigen::Matrix3d> relative_covariances(const std::vector<int>& from, int to) const;

  /// For archives (models/archive.hpp): all that one call leaves to the next.
  template <class A>
  friend void fields(A& a, PlanarPoseGraph& v) {
    a(v.poses_, v.removed_, v.edges_);
  }

 private:
  struct Solver;
  /// Of each node, its place among those that are estimated; -1: it is not. Their number.
  struct Unknowns {
    std::vector<int> of;
    int count = 0;
  };
  Unknowns unknowns() const;
  bool factorise(const Unknowns& unknowns, Eigen::VectorXd* gradient) const;

  std::vector<PlanarPose> poses_;
  std::vector<int> removed_;  // ascending
  std::vector<PlanarEdge> edges_;
  mutable std::unique_ptr<Solver> solver_;
};

}  // namespace lamina
