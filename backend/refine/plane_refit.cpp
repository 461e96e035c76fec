// One small problem a plane: merged moments, and the prior that speaks of this plane alone.
#include <lamina/backend/refine/plane_refit.hpp>

#include <cmath>

#include <lamina/backend/graph/factors/marginal_prior.hpp>
#include <lamina/backend/graph/factors/plane_moments.hpp>
#include <lamina/models/linalg.hpp>

namespace lamina {
namespace {

/// All that is known of one plane at given poses, about its anchor.
struct Evidence {
  Moments moments;
  bool full_view = false;  ///< some observation determines both tilts
  const MarginalPrior* prior = nullptr;
};

bool determines_both_tilts(const Moments& moments) {
  const SymmetricEigen<3> eigen = symmetric_eigen(moments.scatter());
  return eigen.values(1) > 1e-6 * eigen.values(2);
}

bool speaks_of_one_plane(const MarginalPrior& prior) {
  return prior.planes.size() == 1 && prior.keyframes.empty() && prior.surfels.empty();
}

std::vector<Evidence> evidence_of(const Graph& graph) {
  std::vector<Evidence> all(graph.planes.size());
  const auto of = [&](PlaneId id) -> Evidence& {
    return all[static_cast<std::size_t>(&graph.at(id) - graph.planes.data())];
  };
  for (const PlaneMomentsFactor& f : graph.plane_moments) {
    if (!(f.weight > 0)) continue;
    const SE3& T = graph.at(f.keyframe).T_map_body;
    const SE3 T_anchor_body(T.so3(), T.translation() - graph.at(f.plane).anchor_map);
    Evidence& evidence = of(f.plane);
    evidence.moments.merge(f.moments_body.scaled(f.weight).transformed(T_anchor_body));
    evidence.full_view = evidence.full_view || determines_both_tilts(f.moments_body);
  }
  for (const MarginalPrior& prior : graph.marginal_priors) {
    if (speaks_of_one_plane(prior)) of(prior.planes.front()).prior = &prior;
  }
  return all;
}

PlaneMomentsTerm term_of(const Evidence& evidence) {
  return PlaneMomentsTerm(evidence.moments, Eigen::Vector3d::Zero());
}

/// Normal equations of one plane; returns the cost. `term`: of the evidence.
double linearize(const Evidence& evidence, const PlaneMomentsTerm& term, const PlaneState& plane,
                 Eigen::Matrix3d& H, Eigen::Vector3d& g) {
  static const PoseState kAtAnchor;
  PlaneMomentsTerm::Residual r;
  PlaneMomentsTerm::Jacobians jacobians;
  term.evaluate(kAtAnchor, plane, r, &jacobians);
  const auto& J = std::get<1>(jacobians);
  H = J.transpose() * J;
  g = J.transpose() * r;
  double cost = r.squaredNorm();
  if (evidence.prior == nullptr) return cost;
  Eigen::VectorXd r_prior;
  Eigen::MatrixXd J_prior;
  evaluate_marginal_prior(*evidence.prior, {}, {&plane, 1}, {}, r_prior, &J_prior);
  H += J_prior.transpose() * J_prior;
  g += J_prior.transpose() * r_prior;
  return cost + r_prior.squaredNorm();
}

/// The minimum nearest to `start`, by damped Newton steps.
Plane nearest_fit(const Evidence& evidence, const Plane& start) {
  const PlaneMomentsTerm term = term_of(evidence);
  PlaneState plane(start);
  Eigen::Matrix3d H, H_next;
  Eigen::Vector3d g, g_next;
  double cost = linearize(evidence, term, plane, H, g);
  double damping = 1e-9;
  for (int i = 0; i < 20; ++i) {
    Eigen::Matrix3d damped = H;
    damped.diagonal() += damping * (H.diagonal().array() + 1e-9 * H.trace() + 1e-12).matrix();
    const Eigen::LLT<Eigen::Matrix3d> llt(damped);
    if (llt.info() != Eigen::Success) break;
    const Eigen::Vector3d step = -llt.solve(g);
    if (!step.allFinite() || -g.dot(step) < 1e-6) break;
    const PlaneState next = plane.plus(step);
    const double next_cost = linearize(evidence, term, next, H_next, g_next);
    if (next_cost < cost) {
      plane = next;
      cost = next_cost;
      H = H_next;
      g = g_next;
      damping = std::max(1e-9, 0.1 * damping);
    } else {
      damping = std::max(1e-4, 10 * damping);
    }
  }
  return plane.plane();
}

/// The prior with every direction made stiff that the evidence tells less of than half of it does.
void stiffen(MarginalPrior& prior, const Evidence& evidence, const PlaneState& plane) {
  constexpr double kTelling = 4, kStiffness = 100;
  const Eigen::Matrix3d S = prior.sqrt_information;
  const double volume = S.determinant();
  if (!(std::abs(volume) > 0) || !std::isfinite(volume)) return;
  Evidence views_alone = evidence;
  views_alone.prior = nullptr;
  Eigen::Matrix3d H;
  Eigen::Vector3d g;
  linearize(views_alone, term_of(evidence), plane, H, g);
  const Eigen::Matrix3d S_inverse = S.inverse();
  const SymmetricEigen<3> observed =
      symmetric_eigen(Eigen::Matrix3d(S_inverse.transpose() * H * S_inverse));
  Eigen::Matrix3d A = Eigen::Matrix3d::Identity();
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d u = observed.vectors.col(i);
    if (observed.values(i) < kTelling) A += (kStiffness - 1) * u * u.transpose();
  }
  prior.sqrt_information = A * S;
  prior.residual = (A * prior.residual).eval();
}

}  // namespace

std::vector<MarginalPrior> hold_what_nothing_tells(Graph& graph) {
  const std::vector<Evidence> all = evidence_of(graph);
  std::vector<MarginalPrior> before = graph.marginal_priors;
  for (std::size_t i = 0; i < before.size(); ++i) {
    MarginalPrior& prior = graph.marginal_priors[i];
    if (!speaks_of_one_plane(prior) || prior.sqrt_information.rows() != 3) continue;
    const PlaneLandmark& plane = graph.at(prior.planes.front());
    const auto p = static_cast<std::size_t>(&plane - graph.planes.data());
    if (plane.active) stiffen(prior, all[p], PlaneState(plane.plane_anchor));
  }
  return before;
}

void fit_planes_to_evidence(Graph& graph) {
  const std::vector<Evidence> all = evidence_of(graph);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Evidence& evidence = all[i];
    PlaneLandmark& plane = graph.planes[i];
    if (!plane.active || plane.fixed || evidence.moments.empty()) continue;
    if (evidence.prior != nullptr || !evidence.full_view) {
      plane.set_plane_anchor(nearest_fit(evidence, plane.plane_anchor));
      continue;
    }
    // The side it was seen from is known: a body that stands on the plane could not tell.
    const auto fit =
        evidence.moments.fit_plane(evidence.moments.mean() + plane.plane_anchor.normal(), 1.0);
    // Determined to better than a radian: else one spot decided nothing.
    if (fit && fit->covariance.topLeftCorner<2, 2>().trace() < 0.1) {
      plane.set_plane_anchor(fit->plane);
    }
  }
}

}  // namespace lamina
