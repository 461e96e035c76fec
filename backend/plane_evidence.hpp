// Observations of planes and segments as evidence in the body frame of their measurement.
#pragma once

#include <vector>

#include <lamina/backend/association.hpp>
#include <lamina/frontend/observation.hpp>

namespace lamina {

PlaneEvidence make_evidence(const PlaneObservation& observation, const SE3& T_body_sensor);
/// The plane through the segment perpendicular to the scan (the article on planes from a 2D lidar).
/// Of a level scanner: upright on `up_body`, its points at one height.
PlaneEvidence make_evidence(const SegmentObservation& observation, const SE3& T_body_sensor,
                            const Eigen::Vector3d& up_body = Eigen::Vector3d::UnitZ());
/// Planes, then segments.
std::vector<PlaneEvidence> make_evidence(const Observations& observations);

/// The evidence seen from another body frame, to which the motion is known with an error: the error
/// is shared by all of its points, and joins the noise floor. `covariance` of T_to_from in its
/// right tangent.
PlaneEvidence moved(const PlaneEvidence& evidence, const SE3& T_to_from,
                    const Matrix6d& covariance);

}  // namespace lamina
