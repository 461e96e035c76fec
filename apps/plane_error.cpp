// Matching by overlap, then errors at the centroid.
#include <lamina/apps/plane_error.hpp>

#include <algorithm>
#include <cmath>
#include <map>

#include <lamina/models/polygon.hpp>

namespace lamina::apps {
namespace {

constexpr double kDegree = M_PI / 180.0;

// Points spread over an outline: a lattice in its own frame, and its vertices where that is thin.
std::vector<Eigen::Vector3d> samples_of(const MapPlane& plane) {
  std::vector<Eigen::Vector3d> samples;
  const SE3 T_map_plane = plane_frame(plane.plane_map, plane.centroid_map);
  for (const auto& outline : plane.outlines_map) {
    std::vector<Eigen::Vector2d> flat;
    for (const auto& p : outline) flat.push_back((T_map_plane.inverse() * p).head<2>());
    const auto polygon = Polygon::from_vertices(flat);
    if (!polygon) continue;
    const auto [low, high] = polygon->bounds();
    constexpr int kLattice = 16;
    for (int i = 0; i < kLattice; ++i) {
      for (int j = 0; j < kLattice; ++j) {
        const Eigen::Vector2d p = low + Eigen::Vector2d((i + 0.5) / kLattice * (high - low).x(),
                                                        (j + 0.5) / kLattice * (high - low).y());
        if (polygon->contains(p)) samples.push_back(T_map_plane * Eigen::Vector3d(p.x(), p.y(), 0));
      }
    }
  }
  if (samples.empty()) {
    for (const auto& outline : plane.outlines_map) {
      samples.insert(samples.end(), outline.begin(), outline.end());
    }
  }
  if (samples.empty()) samples.push_back(plane.centroid_map);
  return samples;
}

double overlap(const std::vector<Eigen::Vector3d>& samples, const ReferencePlane& reference,
               double border) {
  if (reference.outline.empty()) return 0;
  const SE3 T_plane = plane_frame(reference.plane, reference.outline.front()).inverse();
  std::vector<Eigen::Vector2d> flat;
  for (const auto& p : reference.outline) flat.push_back((T_plane * p).head<2>());
  const auto polygon = Polygon::from_vertices(flat);
  if (!polygon) return 0;
  int inside = 0;
  for (const auto& p : samples) {
    if (polygon->signed_distance((T_plane * p).head<2>()) <= border) ++inside;
  }
  return static_cast<double>(inside) / static_cast<double>(samples.size());
}

PlaneMatch errors_of(const MapPlane& plane, const SE3& T_reference_map,
                     const ReferencePlane& reference) {
  PlaneMatch match;
  match.reference_id = reference.id;
  match.map_id = plane.id;
  // Compared in the map frame, where the covariance stands.
  Plane truth = T_reference_map.inverse() * reference.plane;
  if (truth.normal().dot(plane.plane_map.normal()) < 0) truth = truth.flipped();
  const Eigen::Vector3d d =
      plane.plane_map.about(plane.centroid_map).boxminus(truth.about(plane.centroid_map));
  match.rho_error_m = std::abs(truth.signed_distance(plane.centroid_map));
  match.angle_error_deg = angle_between(plane.plane_map, truth) / kDegree;
  const Eigen::Vector3d variances = plane.covariance.diagonal().cwiseMax(1e-18);
  match.normalized_squared = (d.array().square() / variances.array()).sum();
  return match;
}

void summarise(PlaneErrors& errors) {
  for (const PlaneMatch& match : errors.matches) {
    const auto n = static_cast<double>(errors.matches.size());
    errors.rho_mean_m += match.rho_error_m / n;
    errors.angle_mean_deg += match.angle_error_deg / n;
    errors.rho_max_m = std::max(errors.rho_max_m, match.rho_error_m);
    errors.angle_max_deg = std::max(errors.angle_max_deg, match.angle_error_deg);
  }
}

}  // namespace

PlaneErrors plane_errors(const std::vector<MapPlane>& planes,
                         const std::vector<ReferencePlane>& reference, const SE3& T_reference_map,
                         const PlaneMatchOptions& options) {
  PlaneErrors errors;
  std::map<std::size_t, std::vector<std::pair<double, std::size_t>>> on_reference;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const Plane moved = T_reference_map * planes[i].plane_map;
    const Eigen::Vector3d centroid = T_reference_map * planes[i].centroid_map;
    std::vector<Eigen::Vector3d> samples = samples_of(planes[i]);
    for (auto& p : samples) p = T_reference_map * p;
    int lies_on = 0;
    for (std::size_t j = 0; j < reference.size(); ++j) {
      const double angle = angle_between(moved, reference[j].plane);
      if (angle > options.max_angle) continue;
      if (std::abs(reference[j].plane.signed_distance(centroid)) > options.max_distance) continue;
      const double share = overlap(samples, reference[j], options.border);
      if (share < options.min_overlap) continue;
      on_reference[j].emplace_back(share * planes[i].area, i);
      ++lies_on;
    }
    if (lies_on == 0) errors.spurious.push_back(planes[i].id);
    if (lies_on > 1) errors.merged.push_back(planes[i].id);
  }
  for (std::size_t j = 0; j < reference.size(); ++j) {
    const auto found = on_reference.find(j);
    if (found == on_reference.end()) {
      if (reference[j].hits >= options.min_hits) errors.missed.push_back(reference[j].id);
      continue;
    }
    const auto best = std::max_element(found->second.begin(), found->second.end());
    errors.matches.push_back(errors_of(planes[best->second], T_reference_map, reference[j]));
    if (found->second.size() > 1) errors.split.push_back(reference[j].id);
  }
  summarise(errors);
  return errors;
}

}  // namespace lamina::apps
