// What normal_equations*.cpp share: states, and terms in groups of one type each.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <lamina/backend/graph/factors/gravity.hpp>
#include <lamina/backend/graph/factors/marginal_prior.hpp>
#include <lamina/backend/graph/factors/of_sensor.hpp>
#include <lamina/backend/graph/factors/prior.hpp>
#include <lamina/backend/graph/factors/segment.hpp>
#include <lamina/backend/graph/factors/surfel_moments.hpp>
#include <lamina/backend/solver/native/normal_equations.hpp>
#include <lamina/backend/solver/native/term_group.hpp>

namespace lamina {

struct NormalEquations::Impl {
  detail::AllStates states;
  std::vector<int> sizes;  ///< of variables
  detail::Group<detail::Kernel::kNone, OdometryTerm, detail::PoseKind, detail::PoseKind> odometry,
      loops;
  detail::Group<detail::Kernel::kNone, OdometryOfSensorTerm, detail::PoseKind, detail::PoseKind,
                detail::ExtrinsicsKind>
      odometry_of_sensor, loops_of_sensor;
  detail::Group<detail::Kernel::kNone, PlanarOdometryTerm, detail::PoseKind, detail::PoseKind>
      planar;
  detail::Group<detail::Kernel::kNone, PriorTerm, detail::PoseKind> priors;
  detail::Group<detail::Kernel::kNone, GravityTerm, detail::PoseKind> gravity;
  detail::Group<detail::Kernel::kNone, PriorTerm, detail::ExtrinsicsKind> extrinsics_priors;
  detail::Group<detail::Kernel::kNone, PlaneMomentsTerm, detail::PoseKind, detail::PlaneKind>
      moments;
  detail::Group<detail::Kernel::kNone, PlaneMomentsOfSensorTerm, detail::PoseKind,
                detail::PlaneKind, detail::ExtrinsicsKind>
      moments_of_sensor;
  detail::Group<detail::Kernel::kNone, SegmentTerm, detail::PoseKind, detail::PlaneKind> segments;
  detail::Group<detail::Kernel::kNone, SurfelMomentsOwnTerm, detail::SurfelKind> surfels_own;
  detail::Group<detail::Kernel::kNone, SurfelMomentsTerm, detail::PoseKind, detail::PoseKind,
                detail::SurfelKind>
      surfels;
  detail::Group<detail::Kernel::kCauchyParent, SurfelParentTerm, detail::PoseKind,
                detail::PlaneKind, detail::SurfelKind>
      parents;

  struct Marginal {
    MarginalPrior prior;
    std::vector<int> poses, planes, surfels;  ///< indices of states
    /// It speaks of one plane and nothing else.
    bool own() const { return planes.size() == 1 && poses.empty() && surfels.empty(); }
  };
  std::vector<Marginal> marginals;

  /// A user's factor: its states by kind and place.
  struct Custom {
    CustomFactor factor;
    std::vector<int> poses, own;  ///< by block: the place in that kind's list, or kHeld
    std::size_t index = 0;        ///< in the graph
  };
  std::vector<Custom> customs;
  std::vector<CustomState> own_now, own_before;  ///< states of the user's own
  std::vector<int> own_variable;                 ///< detail::kHeld or the column block
  std::size_t custom_count = 0;                  ///< in the graph
  // Which factor of the graph a term that may be wrong is (or is part of).
  std::vector<std::size_t> loop_factor, loop_of_sensor_factor, moments_factor,
      moments_of_sensor_factor, segment_factor;
  std::size_t loop_count = 0, moments_count = 0, segment_count = 0;  ///< in the graph
  std::vector<double> loop_weights, loop_of_sensor_weights, moments_weights,
      moments_of_sensor_weights, segment_weights;
  std::unique_ptr<BlockCholesky> matrix;
  Eigen::VectorXd gradient;
  // Where planes' distances are taken while solving: the middle of their evidence, and carried
  // along the plane by a step that moves the evidence. The linear system is the same for any such
  // point; what changes is the second order: a plane that turns about a point its evidence moved
  // away from would miss it by tilt times shift, and Newton would crawl along a curved valley.
  std::vector<Eigen::Vector3d> anchors, anchors_before, graph_anchors;
  std::vector<Eigen::Vector4d> middles;
  std::vector<bool> anchor_is_fixed;  ///< held, or a marginal prior over several states has it

  Impl(const Graph& graph, Parts parts);
  void make_states(const Graph& graph);
  void make_pose_terms(const Graph& graph);
  void make_plane_terms(const Graph& graph);
  void make_surfel_terms(const Graph& graph);
  void make_marginals(const Graph& graph);
  void make_custom(const Graph& graph);
  /// Mean of the evidence's means from each anchor (3), and how many they are.
  std::vector<Eigen::Vector4d> evidence_middles();
  void reanchor();
  /// After a step from planes with these normals.
  void carry_anchors(const std::vector<Eigen::Vector3d>& normals);
  void tell_anchors();
  template <class F>
  void each_group(F&& f);
  template <class F>
  void each_kind(F&& f);
  CostByType evaluate(Eigen::VectorXd* out) const;
  double evaluate(const Marginal& marginal, Eigen::VectorXd* out) const;
  double evaluate(const Custom& custom, Eigen::VectorXd* out) const;
  /// At the states of now; false where it cannot be evaluated. `jacobians`: to tangents.
  bool evaluate_blocks(const Custom& custom, bool jacobians, CustomEvaluation& out) const;
  static Eigen::MatrixXd turning_columns(const Eigen::MatrixXd& J, const Marginal& marginal);
  /// J^T J and J^T r of one factor of many blocks, the first `poses` of them poses.
  void add_block_terms(const std::vector<int>& v, std::size_t poses, const Eigen::MatrixXd& J,
                       const Eigen::VectorXd& r, Eigen::VectorXd& out) const;
  std::vector<int> variables(const Marginal& marginal) const;
  std::vector<int> variables(const Custom& custom) const;
};

template <class F>
void NormalEquations::Impl::each_group(F&& f) {
  static const std::vector<double> kOnes;
  f(FactorType::kOdometry, odometry, kOnes);
  f(FactorType::kOdometry, odometry_of_sensor, kOnes);
  f(FactorType::kPlanarOdometry, planar, kOnes);
  f(FactorType::kLoop, loops, loop_weights);
  f(FactorType::kLoop, loops_of_sensor, loop_of_sensor_weights);
  f(FactorType::kPrior, priors, kOnes);
  f(FactorType::kPrior, extrinsics_priors, kOnes);
  f(FactorType::kGravity, gravity, kOnes);
  f(FactorType::kPlaneMoments, moments, moments_weights);
  f(FactorType::kPlaneMoments, moments_of_sensor, moments_of_sensor_weights);
  f(FactorType::kSegment, segments, segment_weights);
  f(FactorType::kSurfelMoments, surfels_own, kOnes);
  f(FactorType::kSurfelMoments, surfels, kOnes);
  f(FactorType::kSurfelParent, parents, kOnes);
}

template <class F>
void NormalEquations::Impl::each_kind(F&& f) {
  f(states.poses);
  f(states.planes);
  f(states.surfels);
  f(states.extrinsics);
}

}  // namespace lamina
