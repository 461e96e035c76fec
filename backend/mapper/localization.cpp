// Two rounds of Gauss-Newton over the body's six degrees of freedom.
#include <lamina/backend/mapper/localization.hpp>

#include <Eigen/Cholesky>
#include <cmath>

#include <lamina/backend/mapper/plane_information.hpp>

namespace lamina {
namespace {

struct NormalEquations {
  Matrix6d H;
  Vector6d g;

  // Moments `m` (body frame) on a plane held still, Huber's weight beyond `bound`.
  void add(const Moments& m, const PlaneLandmark& plane, const SE3& T_map_body, double bound) {
    const Eigen::Vector3d n = T_map_body.so3().inverse() * plane.plane_anchor.normal();
    const double d = plane.plane_anchor.signed_distance(T_map_body * m.mean() - plane.anchor_map);
    const Eigen::Matrix3d turn = SO3::hat(n);
    Vector6d along;
    along << n, m.mean().cross(n);
    Matrix6d information = m.weight() * along * along.transpose();
    information.bottomRightCorner<3, 3>() += turn.transpose() * m.scatter() * turn;
    Vector6d gradient = m.weight() * d * along;
    gradient.tail<3>() += turn.transpose() * (m.scatter() * n);
    const double chi = m.weight() * d * d + n.dot(m.scatter() * n);
    const double weight = chi <= bound ? 1.0 : std::sqrt(bound / chi);
    H += weight * information;
    g += weight * gradient;
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
  NormalEquations equations;
  for (int round = 0; round < 2; ++round) {
    const Vector6d off = (predicted.T_keyframe_body.inverse() * T).log();
    equations = {prior, prior * off};
    for (std::size_t i = 0; i < evidence.size(); ++i) {
      if (decisions[i].plane == PlaneId::kNone) continue;
      equations.add(factor_moments(evidence[i], map.options.association),
                    map.graph.at(decisions[i].plane), map.T_map_keyframe() * T,
                    map.options.window.robust_chi_squared);
    }
    const Vector6d delta = equations.H.llt().solve(-equations.g);
    if (!delta.allFinite()) return predicted;
    T = T * SE3::exp(delta);
  }
  return {T, equations.H.llt().solve(Matrix6d::Identity())};
}

}  // namespace lamina
