// Gates, in the order in which they are cheap.
#include <lamina/backend/association/association.hpp>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <utility>

#include <lamina/models/linalg.hpp>

namespace lamina {

std::vector<std::string> AssociationOptions::problems() const {
  std::vector<std::string> result;
  const auto positive = [&result](double value, const char* name) {
    if (!(value > 0)) result.push_back(std::string(name) + ": expected more than 0");
  };
  positive(gate_full, "association.gate_full");
  positive(gate_partial, "association.gate_partial");
  positive(max_angle_deg, "association.max_angle_deg");
  positive(max_distance_m, "association.max_distance_m");
  positive(surface_sigma_m, "association.surface_sigma_m");
  positive(surface_sigma_deg, "association.surface_sigma_deg");
  positive(max_gap_m, "association.max_gap_m");
  if (!(ambiguous_chi_squared >= 0)) {
    result.emplace_back("association.ambiguous_chi_squared: expected 0 or more");
  }
  return result;
}

const char* to_string(AssociationReason reason) {
  switch (reason) {
    case AssociationReason::kMatched:
      return "matched";
    case AssociationReason::kNoCandidate:
      return "no candidate";
    case AssociationReason::kOtherSide:
      return "other side";
    case AssociationReason::kAngle:
      return "angle";
    case AssociationReason::kDistance:
      return "distance";
    case AssociationReason::kChiSquared:
      return "chi-squared";
    case AssociationReason::kAmbiguous:
      return "ambiguous";
    case AssociationReason::kTooWeak:
      return "too weak";
  }
  return "unknown";
}

namespace {

constexpr double kDegree = M_PI / 180.0;

// The candidate in the body frame: normal and distance of the evidence's centroid from it.
struct Predicted {
  Eigen::Vector3d normal_body;
  double distance = 0;  // signed, of the centroid
};

Predicted predict(const PlaneEvidence& evidence, const SE3& T,
                  const AssociationCandidate& candidate) {
  const Eigen::Vector3d x = T * evidence.moments_body.mean() - candidate.anchor_map;
  return {T.so3().inverse() * candidate.plane_anchor.normal(),
          candidate.plane_anchor.signed_distance(x)};
}

// Angle between what was seen and what was predicted: of planes, or of their lines in the scan.
double angle_off(const PlaneEvidence& evidence, const Eigen::Vector3d& normal_body) {
  Eigen::Vector3d n = normal_body;
  if (evidence.partial) {
    n -= n.dot(evidence.scan_normal_body) * evidence.scan_normal_body;
    // A plane nearly parallel to the scan has no line in it.
    if (n.norm() < 0.1) return M_PI / 2;
    n.normalize();
  }
  return std::atan2(n.cross(evidence.plane_body.normal()).norm(),
                    n.dot(evidence.plane_body.normal()));
}

NoiseFloor surface_floor(const PlaneEvidence& evidence, const AssociationOptions& options) {
  return {std::hypot(evidence.floor.sigma_rho, options.surface_sigma_m),
          std::hypot(evidence.floor.sigma_tilt, options.surface_sigma_deg * kDegree),
          evidence.floor.sigma_bend};
}

}  // namespace

double innovation_chi_squared(const PlaneEvidence& evidence, const SE3& T,
                              const AssociationCandidate& candidate,
                              const AssociationOptions& options) {
  const Moments m = evidence.moments_body.discounted(evidence.plane_body.normal(),
                                                     surface_floor(evidence, options));
  const SymmetricEigen<3> eigen = symmetric_eigen(m.scatter());
  const Eigen::Matrix3d A =
      eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal() * eigen.vectors.transpose();
  const double w = std::sqrt(std::max(0.0, m.weight()));
  const Eigen::Matrix3d Rt = T.so3().matrix().transpose();
  const Predicted predicted = predict(evidence, T, candidate);
  const Eigen::Vector3d& n = predicted.normal_body;
  Eigen::Vector4d r;
  r << A * n, w * predicted.distance;
  const Eigen::Matrix3d turn = SO3::hat(n);
  const Matrix32d RtB = Rt * candidate.plane_anchor.tangent_basis();
  const Eigen::Vector3d arm = T * m.mean() - candidate.anchor_map;
  Eigen::Matrix<double, 4, 9> J = Eigen::Matrix<double, 4, 9>::Zero();
  J.block<3, 3>(0, 3) = A * turn;
  J.block<1, 3>(3, 0) = w * n.transpose();
  J.block<1, 3>(3, 3) = w * (m.mean().transpose() * turn);
  J.block<3, 2>(0, 6) = A * RtB;
  J.block<1, 2>(3, 6) = w * (arm.transpose() * candidate.plane_anchor.tangent_basis());
  J(3, 8) = -w;
  const Eigen::Matrix4d S = Eigen::Matrix4d::Identity() + J * candidate.covariance * J.transpose();
  const Eigen::LLT<Eigen::Matrix4d> llt(S);
  if (llt.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
  const Eigen::Vector4d e = llt.matrixL().solve(r);
  return e.allFinite() ? e.squaredNorm() : std::numeric_limits<double>::infinity();
}

double disagreement_in_view(const PlaneEvidence& a, const PlaneEvidence& b,
                            const AssociationOptions& options) {
  if (a.partial || b.partial) return 0;
  const auto alone = [&options](const PlaneEvidence& e) {
    return e.moments_body.discounted(e.plane_body.normal(), surface_floor(e, options));
  };
  Moments both = alone(a);
  both.merge(alone(b));
  return symmetric_eigen(both.scatter()).values(0);
}

namespace {

// Which gate a candidate misses, with its chi-squared where it is in all of them.
AssociationReason gated(const PlaneEvidence& evidence, const SE3& T,
                        const AssociationCandidate& candidate, const AssociationOptions& options,
                        double& chi_squared) {
  const Predicted predicted = predict(evidence, T, candidate);
  const double off = angle_off(evidence, predicted.normal_body);
  if (off > M_PI / 2) return AssociationReason::kOtherSide;
  if (off > options.max_angle_deg * kDegree) return AssociationReason::kAngle;
  if (!(std::abs(predicted.distance) <= options.max_distance_m)) {
    return AssociationReason::kDistance;
  }
  chi_squared = innovation_chi_squared(evidence, T, candidate, options);
  const double gate = evidence.partial ? options.gate_partial : options.gate_full;
  return chi_squared <= gate ? AssociationReason::kMatched : AssociationReason::kChiSquared;
}

struct BestTwo {
  const AssociationCandidate *first = nullptr, *second = nullptr;
  double chi = std::numeric_limits<double>::infinity(), second_chi = chi;

  void offer(const AssociationCandidate& candidate, double candidate_chi) {
    if (candidate_chi < chi) {
      second = std::exchange(first, &candidate);
      second_chi = std::exchange(chi, candidate_chi);
    } else if (candidate_chi < second_chi) {
      second = &candidate;
      second_chi = candidate_chi;
    }
  }
};

}  // namespace

AssociationDecision associate(const PlaneEvidence& evidence, const SE3& T,
                              std::span<const AssociationCandidate> candidates,
                              const AssociationOptions& options) {
  AssociationDecision decision;
  decision.degrees = evidence.partial ? 2 : 3;
  decision.chi_squared = std::numeric_limits<double>::infinity();
  if (!(evidence.moments_body.weight() > 0) || !evidence.moments_body.mean().allFinite() ||
      !evidence.moments_body.scatter().allFinite()) {
    decision.reason = AssociationReason::kTooWeak;
    return decision;
  }
  BestTwo best;
  for (const auto& candidate : candidates) {
    double chi = 0;
    const AssociationReason reason = gated(evidence, T, candidate, options, chi);
    if (reason == AssociationReason::kMatched) {
      best.offer(candidate, chi);
    } else if (static_cast<int>(reason) > static_cast<int>(decision.reason)) {
      decision.reason = reason;  // the nearest miss: later gates are nearer to a match
    }
  }
  if (!best.first) return decision;
  decision.chi_squared = best.chi;
  decision.plane = best.first->id;
  decision.reason = AssociationReason::kMatched;
  if (best.second && best.second_chi - best.chi < options.ambiguous_chi_squared) {
    const double apart = std::abs(predict(evidence, T, *best.first).distance -
                                  predict(evidence, T, *best.second).distance);
    if (apart > 0.1 * options.max_distance_m) {
      decision.plane = PlaneId::kNone;
      decision.reason = AssociationReason::kAmbiguous;
    }
  }
  return decision;
}

}  // namespace lamina
