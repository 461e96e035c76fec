// Observations of planes and segments as evidence in the body frame of their measurement.
#pragma once

#include <optional>
#include <vector>

#include <lamina/backend/association/association.hpp>
#include <lamina/models/observation.hpp>

namespace lamina {

/// What a scan segment says of its plane.
enum class PartialView {
  kMoments,   ///< its returns, by their moments
  kEndPoints  ///< the article's constraint: rotation between segment and plane, mean distance of
              ///< its end points, whitened by the fit (backend/graph/factors/segment.hpp)
};

PlaneEvidence make_evidence(const PlaneObservation& observation, const SE3& T_body_sensor);
/// The plane through the segment perpendicular to the scan (the article on planes from a 2D lidar).
/// Of a level scanner: upright on `up_body`, its points at one height.
PlaneEvidence make_evidence(const SegmentObservation& observation, const SE3& T_body_sensor,
                            const Eigen::Vector3d& up_body = Eigen::Vector3d::UnitZ(),
                            PartialView form = PartialView::kMoments);
/// Planes, then segments.
std::vector<PlaneEvidence> make_evidence(const Observations& observations,
                                         PartialView form = PartialView::kMoments);

/// The evidence seen from another body frame, to which the motion is known with an error: the error
/// is shared by all of its points, and joins the noise floor. `covariance` of T_to_from in its
/// right tangent.
PlaneEvidence moved(const PlaneEvidence& evidence, const SE3& T_to_from,
                    const Matrix6d& covariance);

/// What one keyframe saw of one plane, in its body frame. Views of one kind of sensor share their
/// noise floor (PlaneEvidence::join()); images and lines of scans do not: each have their own.
class PlaneViews {
 public:
  explicit PlaneViews(const PlaneEvidence& view) { join(view); }
  void join(const PlaneEvidence& view);
  void join(const PlaneViews& other);
  /// Lines alone: rotation about them is not seen.
  bool partial() const { return !full_; }
  const std::optional<PlaneEvidence>& full() const { return full_; }
  const std::optional<PlaneEvidence>& lines() const { return lines_; }
  /// All of what shows the plane best: the images, if any.
  const PlaneEvidence& best() const { return full_ ? *full_ : *lines_; }

 private:
  std::optional<PlaneEvidence> full_, lines_;  // one of them at least
};

}  // namespace lamina
