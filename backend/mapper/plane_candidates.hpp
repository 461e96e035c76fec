// Planes of the map that a view may be of.
#pragma once

#include <lamina/backend/mapper/localization.hpp>

namespace lamina {

/// Active planes whose evidence touches what was seen from T_map_body (body frame), or lies near
/// it, with their covariances relative to the present keyframe.
std::vector<AssociationCandidate> plane_candidates(const WorkingMap& map,
                                                   const PlaneEvidence& evidence,
                                                   const SE3& T_map_body);

/// From the keyframe's pose and the plane to the body's pose and the plane.
JointCovariance carried(const JointCovariance& joint, const BodyInKeyframe& body);

/// The options for the one candidate that the front-end followed to this scan: it is taken for the
/// same plane within the chi-squared gate, the prediction being too unsure for the other gates
/// where a fast scanner meets planes whose tilt is not known yet. 60 degrees stay.
AssociationOptions when_followed(const AssociationOptions& options);

}  // namespace lamina
