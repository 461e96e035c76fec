// Both tangents brought to one point and one basis.
#include <lamina/backend/association/plane_difference.hpp>

#include <cmath>

namespace lamina {

Eigen::Matrix3d about_middle(const PlaneLandmark& plane, const Eigen::Vector3d& middle_map,
                             const Matrix32d& basis) {
  const Matrix32d B = plane.plane_anchor.tangent_basis();
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J.topLeftCorner<2, 2>() = basis.transpose() * B;
  J.bottomLeftCorner<1, 2>() = -(middle_map - plane.anchor_map).transpose() * B;
  return J;
}

PlaneGap gap_between(const PlaneLandmark& a, const PlaneLandmark& b,
                     const Eigen::Vector3d& middle) {
  PlaneGap gap;
  gap.off = a.plane_map().about(middle).boxminus(b.plane_map().about(middle));
  const Matrix32d B = b.plane_anchor.tangent_basis();
  gap.J << about_middle(a, middle, B), -about_middle(b, middle, B);
  return gap;
}

Eigen::Vector3d surface_noise(const AssociationOptions& options) {
  // Each of the two is its own fit.
  const double tilt = std::sqrt(2.0) * options.surface_sigma_deg * M_PI / 180;
  const double rho = std::sqrt(2.0) * options.surface_sigma_m;
  return {tilt * tilt, tilt * tilt, rho * rho};
}

}  // namespace lamina
