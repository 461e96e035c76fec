// Upright about the line that was seen.
#include <lamina/backend/mapper/fallen_planes.hpp>

#include <cmath>

namespace lamina {

std::size_t hold_fallen(WorkingMap& map) {
  constexpr double kFallen = 0.5;      // sine of what a wall may lean on the scan: 30 degrees
  constexpr double kSigmaShare = 0.2;  // of the prior's
  SlidingWindow& window = map.window;
  std::size_t held = 0;
  for (const auto& [id, views] : map.gathered) {
    if (!map.partial.count(id) || !views.partial() || !window.contains(id)) continue;
    const PlaneEvidence& evidence = views.best();
    const Eigen::Vector3d scan = window.pose(map.keyframe).so3() * evidence.scan_normal_body;
    const Plane now = window.plane_anchor(id);
    const double lean = now.normal().dot(scan);
    if (std::abs(lean) < kFallen) continue;
    // The line it makes in the scan now says nothing: the one that was seen does.
    Eigen::Vector3d upright = window.pose(map.keyframe).so3() * evidence.plane_body.normal();
    upright -= upright.dot(scan) * scan;
    const auto at = Plane::from_normal_rho(upright, 0);
    if (!at) continue;
    const Eigen::Vector3d seen = window.pose(map.keyframe) * evidence.moments_body.mean();
    const double rho = at->normal().dot(seen - map.graph.at(id).anchor_map);
    held += window.add_prior(id, Plane(at->normal(), rho),
                             kSigmaShare * map.options.prior_tilt_deg * (M_PI / 180.0),
                             map.options.prior_distance_m);
  }
  return held;
}

std::size_t stand_up_fallen(WorkingMap& map) {
  constexpr double kFallen = 0.5;  // of the normal's z: 30 degrees
  constexpr double kFirmer = 5;
  const double as_new = 1 / map.options.prior_tilt();
  std::size_t stood_up = 0;
  for (MarginalPrior& prior : map.graph.marginal_priors) {
    if (prior.planes.size() != 1 || prior.dimension() != 3 || !map.partial.count(prior.planes[0]))
      continue;
    PlaneLandmark& plane = map.graph.at(prior.planes[0]);
    const bool held = prior.sqrt_information.topLeftCorner<2, 2>().norm() > 2 * as_new;
    if (!plane.active || held || std::abs(plane.plane_anchor.normal().z()) < kFallen) continue;
    Moments merged;
    for (const PlaneMomentsFactor& f : map.graph.plane_moments) {
      if (f.plane != plane.id) continue;
      merged.merge(f.moments_body.transformed(map.graph.at(f.keyframe).T_map_body));
    }
    const auto line = merged.fit_line();
    if (!line) continue;
    Eigen::Vector3d n = line->direction.cross(Eigen::Vector3d::UnitZ());
    if (n.dot(prior.planes_linear[0].normal()) < 0) n = -n;
    const auto upright = Plane::from_normal_rho(n, n.dot(merged.mean() - plane.anchor_map));
    if (!upright) continue;
    plane.plane_anchor = *upright;
    prior.planes_linear[0] = *upright;
    // In the plane's tangent: which way is a lean, and which a turn.
    const Eigen::Vector2d lean = upright->tangent_basis().transpose() * Eigen::Vector3d::UnitZ();
    prior.sqrt_information.topLeftCorner<2, 2>() << as_new * kFirmer * lean.transpose(),
        as_new * Eigen::RowVector2d(-lean.y(), lean.x());
    ++stood_up;
  }
  return stood_up;
}

}  // namespace lamina
