// Matching by overlap, then errors at the centroid.
#include <lamina/pipeline/evaluation/plane_error.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include <lamina/models/checked_cast.hpp>
#include <lamina/models/polygon.hpp>

namespace lamina {
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
    const Eigen::Vector2d size = high - low;
    const auto steps = [](double length) { return to_whole(std::ceil(length / 0.1), 4, 64); };
    const int nx = steps(size.x()), ny = steps(size.y());
    for (int i = 0; i < nx; ++i) {
      for (int j = 0; j < ny; ++j) {
        const Eigen::Vector2d p =
            low + Eigen::Vector2d((i + 0.5) / nx * size.x(), (j + 0.5) / ny * size.y());
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

// In plan: a scanner sees a wall at one height, a camera up to where its image ends.
double length_in_plan(const std::vector<Eigen::Vector3d>& points) {
  if (points.empty()) return 0;
  Eigen::Vector2d low = points.front().head<2>(), high = low;
  for (const auto& p : points) {
    low = low.cwiseMin(p.head<2>());
    high = high.cwiseMax(p.head<2>());
  }
  return (high - low).norm();
}

// A reference plane as it is asked: which points lie on it?
class Target {
 public:
  explicit Target(const ReferencePlane& reference) : plane_(reference.plane) {
    if (reference.outline.empty()) return;
    T_plane_ = plane_frame(reference.plane, reference.outline.front()).inverse();
    std::vector<Eigen::Vector2d> flat;
    for (const auto& p : reference.outline) flat.push_back((T_plane_ * p).head<2>());
    polygon_ = Polygon::from_vertices(flat);
    length_ = length_in_plan(reference.outline);
  }
  // Distance from the outline in the plane, negative inside.
  double beside(const Eigen::Vector3d& p) const {
    if (!polygon_) return std::numeric_limits<double>::infinity();
    return polygon_->signed_distance((T_plane_ * p).head<2>());
  }
  double above(const Eigen::Vector3d& p) const { return std::abs(plane_.signed_distance(p)); }
  double length() const { return length_; }

 private:
  Plane plane_;
  SE3 T_plane_;
  std::optional<Polygon> polygon_;
  double length_ = 0;
};

// One wall for each set of references that lie in one plane with doors between them at most: a map
// plane that goes on beyond a door is right.
std::vector<std::size_t> walls_of(const std::vector<ReferencePlane>& reference,
                                  const std::vector<Target>& targets,
                                  const PlaneMatchOptions& options) {
  std::vector<std::size_t> wall(reference.size());
  for (std::size_t i = 0; i < wall.size(); ++i) wall[i] = i;
  for (std::size_t i = 0; i < wall.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (wall[i] == wall[j]) continue;
      if (angle_between(reference[i].plane, reference[j].plane) > options.coplanar_angle) continue;
      double apart = std::numeric_limits<double>::infinity();
      bool coplanar = true;
      for (const auto& p : reference[j].outline) {
        coplanar = coplanar && targets[i].above(p) <= options.coplanar_distance;
        apart = std::min(apart, targets[i].beside(p));
      }
      for (const auto& p : reference[i].outline) apart = std::min(apart, targets[j].beside(p));
      if (!coplanar || apart > options.door) continue;
      const std::size_t from = std::max(wall[i], wall[j]), into = std::min(wall[i], wall[j]);
      std::replace(wall.begin(), wall.end(), from, into);
    }
  }
  return wall;
}

// What of a map plane lies on each reference: every point counts for the one nearest to it.
std::map<std::size_t, std::vector<Eigen::Vector3d>> assigned(
    const std::vector<Eigen::Vector3d>& samples, const std::vector<std::size_t>& candidates,
    const std::vector<Target>& targets, const PlaneMatchOptions& options) {
  std::map<std::size_t, std::vector<Eigen::Vector3d>> result;
  constexpr double kSame = 1e-3;  // m: neighbours in one plane, told apart by their outlines
  for (const auto& p : samples) {
    std::optional<std::size_t> best;
    double best_above = 0, best_beside = 0;
    for (const std::size_t j : candidates) {
      const double above = targets[j].above(p), beside = targets[j].beside(p);
      if (above > options.max_distance || beside > options.border) continue;
      const bool nearer = !best || above < best_above - kSame ||
                          (above < best_above + kSame && beside < best_beside);
      if (!nearer) continue;
      best = j;
      best_above = above;
      best_beside = beside;
    }
    if (best) result[*best].push_back(p);
  }
  return result;
}

// The reference plane in the map's frame, where the covariance stands, seen from the plane's side.
Plane in_map(const ReferencePlane& reference, const SE3& T_reference_map, const MapPlane& plane) {
  const Plane truth = T_reference_map.inverse() * reference.plane;
  return truth.normal().dot(plane.plane_map.normal()) < 0 ? truth.flipped() : truth;
}

PlaneMatch errors_of(const MapPlane& plane, const SE3& T_reference_map,
                     const SE3& T_reference_datum, const ReferencePlane& reference) {
  PlaneMatch match;
  match.reference_id = reference.id;
  match.map_id = plane.id;
  const Plane truth = in_map(reference, T_reference_map, plane);
  match.rho_error_m = std::abs(truth.signed_distance(plane.centroid_map));
  match.angle_error_deg = angle_between(plane.plane_map, truth) / kDegree;
  // In the map plane's own basis: the truth's may have jumped.
  const Eigen::Vector3d d = in_map(reference, T_reference_datum, plane)
                                .about(plane.centroid_map)
                                .boxminus(plane.plane_map.about(plane.centroid_map));
  const Eigen::Matrix3d C =
      plane.covariance + plane.covariance_mounting + 1e-18 * Eigen::Matrix3d::Identity();
  match.normalized_squared = d.dot(C.ldlt().solve(d));
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
                         const PlaneMatchOptions& options,
                         const std::optional<SE3>& T_reference_datum) {
  PlaneErrors errors;
  const std::vector<Target> targets(reference.begin(), reference.end());
  const std::vector<std::size_t> wall = walls_of(reference, targets, options);
  std::map<std::size_t, std::vector<std::pair<double, std::size_t>>> on_reference;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const Plane moved = T_reference_map * planes[i].plane_map;
    std::vector<Eigen::Vector3d> samples = samples_of(planes[i]);
    for (auto& p : samples) p = T_reference_map * p;
    std::vector<std::size_t> candidates;
    for (std::size_t j = 0; j < reference.size(); ++j) {
      if (angle_between(moved, reference[j].plane) <= options.max_angle) candidates.push_back(j);
    }
    std::set<std::size_t> walls;
    bool lies = false;
    for (const auto& [j, points] : assigned(samples, candidates, targets, options)) {
      const double share = static_cast<double>(points.size()) / static_cast<double>(samples.size());
      const bool much = share >= options.min_overlap;
      if (!much && length_in_plan(points) < options.min_length * targets[j].length()) continue;
      on_reference[j].emplace_back(share * planes[i].area, i);
      lies = true;
      if (much) walls.insert(wall[j]);
    }
    if (!lies) errors.spurious.push_back(planes[i].id);
    if (walls.size() > 1) errors.merged.push_back(planes[i].id);
  }
  for (std::size_t j = 0; j < reference.size(); ++j) {
    const auto found = on_reference.find(j);
    if (found == on_reference.end()) {
      if (reference[j].hits >= options.min_hits) errors.missed.push_back(reference[j].id);
      continue;
    }
    const auto best = std::max_element(found->second.begin(), found->second.end());
    errors.matches.push_back(errors_of(planes[best->second], T_reference_map,
                                       T_reference_datum.value_or(T_reference_map), reference[j]));
    if (found->second.size() > 1) errors.split.push_back(reference[j].id);
  }
  summarise(errors);
  return errors;
}

std::vector<std::pair<std::int64_t, std::int64_t>> near_pairs(const std::vector<MapPlane>& planes,
                                                              const NearOptions& options) {
  std::vector<std::vector<Target>> outlines;  // of each plane
  std::vector<std::vector<Eigen::Vector3d>> samples;
  for (const MapPlane& plane : planes) {
    auto& targets = outlines.emplace_back();
    for (const auto& outline : plane.outlines_map) {
      targets.emplace_back(ReferencePlane{plane.id, plane.plane_map, outline, 0});
    }
    samples.push_back(samples_of(plane));
  }
  const auto before = [&](std::size_t a, std::size_t b) {
    std::size_t inside = 0;
    for (const auto& p : samples[a]) {
      inside += std::any_of(outlines[b].begin(), outlines[b].end(), [&](const Target& target) {
        return target.above(p) <= options.max_distance && target.beside(p) <= options.border;
      });
    }
    return static_cast<double>(inside) >=
           options.min_overlap * static_cast<double>(samples[a].size());
  };
  std::vector<std::pair<std::int64_t, std::int64_t>> found;
  for (std::size_t a = 0; a < planes.size(); ++a) {
    for (std::size_t b = a + 1; b < planes.size(); ++b) {
      if (angle_between(planes[a].plane_map, planes[b].plane_map) > options.max_angle) continue;
      if (before(a, b) || before(b, a)) found.emplace_back(planes[a].id, planes[b].id);
    }
  }
  return found;
}

}  // namespace lamina
