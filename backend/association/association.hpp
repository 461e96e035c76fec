// Which plane of the map is this observation of? Chi-squared gates on the predicted observation,
// overlap of outlines, and a reason for every answer.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

struct AssociationOptions {
  /// Bound on the chi-squared of what is left between observation and prediction, both uncertain:
  /// 3 degrees of freedom for a depth plane, 2 for a scan segment, at 99.9 %.
  double gate_full = 16.3;
  double gate_partial = 13.8;
  double max_angle_deg = 12;  ///< and never further apart than this, however unsure the prediction
  double max_distance_m = 0.3;  ///< nor than this, at the observation's centroid
  /// Floor on what two views of one real surface disagree by: walls are not planes. 1-sigma.
  double surface_sigma_m = 0.004;
  double surface_sigma_deg = 0.2;
  /// An observation may lie this far beyond the known outline of its plane: doors and pillars
  /// interrupt walls.
  double max_gap_m = 1.5;
  /// A second candidate within this of the best chi-squared makes the answer ambiguous when the
  /// two planes differ by more than max_distance_m / 10.
  double ambiguous_chi_squared = 2.0;

  std::vector<std::string> problems() const;
};

/// One plane or segment, in the body frame of its measurement, as the association wants it.
struct PlaneEvidence {
  Plane plane_body;      ///< normal towards the sensor; a segment's is perpendicular to its scan
  Moments moments_body;  ///< weights 1/sigma^2 along the normal (1/m^2), not discounted
  NoiseFloor floor;
  std::vector<Eigen::Vector3d> outline_body;  ///< closed polygon, or the two ends of a segment
  bool partial = false;                       ///< a segment: rotation about its line is not seen
  Eigen::Vector3d scan_normal_body = Eigen::Vector3d::UnitZ();  ///< partial: normal of the scan
  LabelVotes votes;
  ExtrinsicsId sensor = ExtrinsicsId::kNone;  ///< that saw it; kNone: several, or nobody knows

  /// Adds another view of the same plane in the same frame by the same kind of sensor. Views of one
  /// place share their noise floor, so it does not average: the smaller one stays.
  void join(const PlaneEvidence& other);
};

enum class AssociationReason {
  kMatched,      ///< the one candidate inside all gates, or the best by far
  kNoCandidate,  ///< no known plane near
  kOtherSide,    ///< nearest candidate is seen from behind
  kAngle,        ///< nearest candidate is turned too far
  kDistance,     ///< nearest candidate is too far along the normal
  kChiSquared,   ///< nearest candidate disagrees by more than both are unsure
  kAmbiguous,    ///< two candidates fit alike: used for neither
  kTooWeak       ///< the observation constrains nothing
};
const char* to_string(AssociationReason reason);

struct AssociationDecision {
  PlaneId plane = PlaneId::kNone;
  AssociationReason reason = AssociationReason::kNoCandidate;
  double chi_squared = 0;  ///< of the best candidate
  int degrees = 0;
};

/// A plane the observation could be of, with what is not known of it relative to the body.
struct AssociationCandidate {
  PlaneId id = PlaneId::kNone;
  Plane plane_anchor;  ///< map axes, origin at the anchor
  Eigen::Vector3d anchor_map = Eigen::Vector3d::Zero();
  /// Joint covariance of the body's pose (right tangent) and the plane (boxplus tangent).
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
};

/// The innovation of `evidence` against one candidate, whitened by both: chi-squared with 3 degrees
/// (full) or 2 (partial). The residual is the plane moments factor's, r = L^T p, with covariance
/// I + J P J^T: full and partial views share the formula.
double innovation_chi_squared(const PlaneEvidence& evidence, const SE3& T_map_body,
                              const AssociationCandidate& candidate,
                              const AssociationOptions& options);

/// Chi-squared, 3 degrees, of two full views of one moment being one plane: no pose stands between
/// them, so that a slab of 4 cm before a wall is told from it however unsure the pose is. Partial
/// views: 0.
double disagreement_in_view(const PlaneEvidence& a, const PlaneEvidence& b,
                            const AssociationOptions& options);

/// Best candidate inside all gates. `candidates` are near already (PlaneIndex).
AssociationDecision associate(const PlaneEvidence& evidence, const SE3& T_map_body,
                              std::span<const AssociationCandidate> candidates,
                              const AssociationOptions& options);

}  // namespace lamina
