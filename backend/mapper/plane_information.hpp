// What evidence says of a plane, as factors and covariances have it.
#pragma once

#include <lamina/backend/association/plane_evidence.hpp>

namespace lamina {

/// Whether scans of this normal (unit, map or body frame) are level to 20 degrees.
bool scan_is_level(const Eigen::Vector3d& scan_normal);

/// Moments in the evidence's own body frame, m, with what all of its points share taken off their
/// information: the noise floor and how plane surfaces are (AssociationOptions::surface_sigma_*).
Moments factor_moments(const PlaneEvidence& evidence, const AssociationOptions& options);
/// Images and lines of scans together, each with its own floor.
Moments factor_moments(const PlaneViews& views, const AssociationOptions& options);
/// The same as a factor of weight 1, with the sensors that saw it.
PlaneMomentsFactor factor_of(KeyframeId keyframe, PlaneId plane, const PlaneViews& views,
                             const AssociationOptions& options);

/// Information of discounted moments (map axes) on a plane's tangent (tilt, tilt, rho) about their
/// mean.
Eigen::Matrix3d plane_information(const Moments& m, const Eigen::Vector3d& normal);

}  // namespace lamina
