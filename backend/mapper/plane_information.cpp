// Shared errors taken off the information of moments.
#include <lamina/backend/mapper/plane_information.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/linalg.hpp>

namespace lamina {

bool scan_is_level(const Eigen::Vector3d& scan_normal) {
  constexpr double kLevelScan = 0.94;  // cosine: within 20 degrees
  return std::abs(scan_normal.z()) > kLevelScan;
}

Moments factor_moments(const PlaneEvidence& e, const AssociationOptions& options) {
  NoiseFloor floor = e.floor;
  floor.sigma_rho = std::hypot(floor.sigma_rho, options.surface_sigma_m);
  floor.sigma_tilt = std::hypot(floor.sigma_tilt, options.surface_sigma_deg * (M_PI / 180.0));
  if (!e.partial || scan_is_level(e.scan_normal_body)) {
    return e.moments_body.discounted(e.plane_body.normal(), floor);
  }
  // Lines of a leaning scanner that moved span a plane that need not be upright on them: each axis
  // of their extent as it is. (Those of a level one lie in one level plane, whatever they are of:
  // how they scatter across each other is noise.)
  const Moments& m = e.moments_body;
  const SymmetricEigen<3> eigen = symmetric_eigen(m.scatter());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const double information = std::max(0.0, eigen.values(i));
    const Eigen::Vector3d axis = eigen.vectors.col(i);
    scatter += information / (1 + information * floor.sigma_tilt * floor.sigma_tilt) * axis *
               axis.transpose();
  }
  const double weight = m.weight() / (1 + m.weight() * floor.sigma_rho * floor.sigma_rho);
  return Moments(weight, m.mean(), scatter, m.count());
}

Moments factor_moments(const PlaneViews& views, const AssociationOptions& options) {
  Moments m;
  if (views.full()) m.merge(factor_moments(*views.full(), options));
  if (views.lines()) m.merge(factor_moments(*views.lines(), options));
  return m;
}

PlaneMomentsFactor factor_of(KeyframeId keyframe, PlaneId plane, const PlaneViews& views,
                             const AssociationOptions& options) {
  PlaneMomentsFactor factor{keyframe, plane, factor_moments(views, options), views.best().sensor,
                            1.0};
  if (!views.full() || !views.lines() || views.full()->sensor == views.lines()->sensor)
    return factor;
  factor.extrinsics = ExtrinsicsId::kNone;
  for (const auto& seen : {views.full(), views.lines()}) {
    factor.by_sensor.push_back({seen->sensor, factor_moments(*seen, options)});
  }
  return factor;
}

Eigen::Matrix3d plane_information(const Moments& m, const Eigen::Vector3d& normal) {
  const Matrix32d B = Plane::tangent_basis(normal);
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  H.topLeftCorner<2, 2>() = B.transpose() * m.scatter() * B;
  H(2, 2) = m.weight();
  return H;
}

}  // namespace lamina
