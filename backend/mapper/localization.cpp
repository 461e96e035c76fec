// Two rounds of Gauss-Newton over the body's six degrees of freedom.
#include <lamina/backend/mapper/localization.hpp>

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include <lamina/backend/graph/factors/plane_moments.hpp>
#include <lamina/backend/mapper/plane_information.hpp>

namespace lamina {
namespace {

// A view of a plane of the map.
struct View {
  PlaneMomentsTerm term;
  PlaneState plane;
};

std::vector<View> views_of(const WorkingMap& map, std::span<const PlaneEvidence> evidence,
                           std::span<const AssociationDecision> decisions) {
  std::vector<View> views;
  for (std::size_t i = 0; i < evidence.size(); ++i) {
    if (decisions[i].plane == PlaneId::kNone) continue;
    const PlaneLandmark& plane = map.graph.at(decisions[i].plane);
    views.push_back({{factor_moments(evidence[i], map.options.association), plane.anchor_map},
                     PlaneState(plane.plane_anchor)});
  }
  return views;
}

struct PoseEquations {
  Matrix6d H;
  Vector6d g;

  // The plane held still, Huber's weight beyond `bound`.
  void add(const View& view, const PoseState& body, double bound) {
    PlaneMomentsTerm::Residual r;
    PlaneMomentsTerm::Jacobians J;
    view.term.evaluate(body, view.plane, r, &J);
    const double chi = r.squaredNorm();
    const double weight = chi <= bound ? 1.0 : std::sqrt(bound / chi);
    const auto& J_pose = std::get<0>(J);
    H += weight * J_pose.transpose() * J_pose;
    g += weight * J_pose.transpose() * r;
  }
};

}  // namespace

void BodyInKeyframe::advance(const SE3& T_prev_body, const Matrix6d& increment) {
  const Matrix6d A = T_prev_body.inverse().adjoint();
  T_keyframe_body = T_keyframe_body * T_prev_body;
  covariance = A * covariance * A.transpose() + increment;
}

BodyInKeyframe localized(const WorkingMap& map, std::span<const PlaneEvidence> evidence,
                         std::span<const AssociationDecision> decisions,
                         const BodyInKeyframe& predicted) {
  const Eigen::LLT<Matrix6d> llt(predicted.covariance);
  if (llt.info() != Eigen::Success) return predicted;
  const Matrix6d prior = llt.solve(Matrix6d::Identity());
  SE3 T = predicted.T_keyframe_body;
  const std::vector<View> views = views_of(map, evidence, decisions);
  PoseEquations equations;
  for (int round = 0; round < 2; ++round) {
    const Vector6d off = (predicted.T_keyframe_body.inverse() * T).log();
    equations = {prior, prior * off};
    const PoseState body(map.T_map_keyframe() * T);
    for (const View& view : views) {
      equations.add(view, body, map.options.window.robust_chi_squared);
    }
    const Vector6d delta = equations.H.llt().solve(-equations.g);
    if (!delta.allFinite()) return predicted;
    T = T * SE3::exp(delta);
  }
  return {T, equations.H.llt().solve(Matrix6d::Identity())};
}

}  // namespace lamina
