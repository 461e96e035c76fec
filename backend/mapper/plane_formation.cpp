// Planes fitted to all their views; enough of them make a landmark.
#include <lamina/backend/mapper/plane_formation.hpp>

#include <Eigen/Cholesky>
#include <cmath>

#include <lamina/backend/association/outline_gap.hpp>
#include <lamina/backend/mapper/plane_candidates.hpp>
#include <lamina/backend/mapper/plane_information.hpp>

namespace lamina {
namespace {

// The plane through partial views: along their common line, as upright on the scans as a prior of
// `tilt_sigma` and what the views say of the tilt leave it. The best of
//   n^T S n + |n - n_upright|^2 / tilt_sigma^2   over unit n, by Gauss-Newton; it goes through the
// moments' mean.
std::optional<Plane> upright_plane(const Moments& m, const Eigen::Vector3d& scan_normal,
                                   const Eigen::Vector3d& towards, double tilt_sigma) {
  const auto line = m.fit_line();
  if (!line) return std::nullopt;
  Eigen::Vector3d upright = line->direction.cross(scan_normal);
  // Views that moved along their plane have their longest extent that way, not along the scan.
  if (upright.norm() < 0.5) upright = towards - towards.dot(scan_normal) * scan_normal;
  if (!(upright.norm() > 1e-6)) return std::nullopt;
  if (upright.dot(towards) < 0) upright = -upright;
  upright.normalize();
  const double prior = 1 / (tilt_sigma * tilt_sigma);
  Eigen::Vector3d n = upright;
  for (int round = 0; round < 10; ++round) {
    const Matrix32d B = Plane::tangent_basis(n);
    const Eigen::Matrix2d H = B.transpose() * m.scatter() * B + prior * Eigen::Matrix2d::Identity();
    const Eigen::Vector2d g = B.transpose() * (m.scatter() * n - prior * upright);
    const Eigen::Vector2d step = -H.ldlt().solve(g);
    if (!step.allFinite()) return std::nullopt;
    n = (n + B * step).normalized();
  }
  if (n.dot(towards) < 0) n = -n;
  return Plane::from_normal_rho(n, n.dot(m.mean()));
}

// From all its evidence, not the first sighting: moments add.
void refit_one(FormingPlane& t, const WorkingMap& map) {
  constexpr double kOpenTiltDegrees = 45;
  Moments merged;
  Eigen::Vector3d towards = Eigen::Vector3d::Zero(), scan_normal = Eigen::Vector3d::Zero();
  bool partial = true;
  for (const auto& [id, views] : t.evidence) {
    const Keyframe* keyframe = map.graph.find(id);
    if (keyframe == nullptr) continue;
    merged.merge(factor_moments(views, map.options.association).transformed(keyframe->T_map_body));
    towards += keyframe->T_map_body.so3() * views.best().plane_body.normal();
    scan_normal = keyframe->T_map_body.so3() * views.best().scan_normal_body;
    partial = partial && views.partial();
  }
  std::optional<Plane> plane;
  if (!merged.empty() && merged.mean().allFinite()) {
    // Level scanners meet walls; what one that hangs or leans meets may have any tilt.
    const bool open = partial && !scan_is_level(scan_normal);
    t.tilt_sigma = open ? kOpenTiltDegrees * (M_PI / 180.0) : map.options.prior_tilt();
    if (partial) {
      plane = upright_plane(merged, scan_normal, towards, t.tilt_sigma);
    } else if (const auto fit = merged.fit_plane(merged.mean() + towards, 1.0)) {
      plane = fit->plane;
    }
    if (!plane) plane = Plane::from_normal_rho(towards, towards.dot(merged.mean()));
  }
  if (!plane) {
    t.evidence.clear();
    return;
  }
  t.landmark.anchor_map = plane->project(merged.mean());
  t.landmark.plane_anchor = plane->about(t.landmark.anchor_map);
  Eigen::Matrix3d H = plane_information(merged, plane->normal());
  const double tilt = 1 / t.tilt_sigma;
  H.diagonal() += Eigen::Vector3d(tilt * tilt, tilt * tilt, 1e-6);
  t.landmark.covariance = H.llt().solve(Eigen::Matrix3d::Identity());
}

// Whether an observation comes within `reach` to two of anything that was seen of a plane in the
// making. Strokes may be further away from strokes.
bool touches(const std::map<KeyframeId, PlaneViews>& seen, const PlaneEvidence& evidence,
             const SE3& T_map_body, const Graph& graph, double reach) {
  constexpr double kSpacing = 0.25;  // m, of points on outlines
  const bool strokes =
      std::all_of(seen.begin(), seen.end(), [](const auto& one) { return one.second.partial(); });
  if (evidence.partial && strokes) return true;
  PlaneIndex places(reach);
  const auto sampled = [](const std::vector<Eigen::Vector3d>& outline, const SE3& T,
                          double spacing) {
    std::vector<Eigen::Vector3d> all = sample_outline(outline, spacing);
    for (auto& p : all) p = T * p;
    return all;
  };
  places.insert(PlaneId(0), sampled(evidence.outline_body, T_map_body, reach));
  bool near = false;
  std::vector<Eigen::Vector3d> there;
  for (const auto& [id, one] : seen) {
    const Keyframe* keyframe = graph.find(id);
    if (!keyframe) continue;
    const auto& outline = one.best().outline_body;
    near = near || !places.near(sampled(outline, keyframe->T_map_body, reach)).empty();
    const auto more = sampled(outline, keyframe->T_map_body, kSpacing);
    there.insert(there.end(), more.begin(), more.end());
  }
  return near && beside(sampled(evidence.outline_body, T_map_body, kSpacing), there, 2 * reach);
}

}  // namespace

std::vector<AssociationCandidate> PlaneFormation::candidates() const {
  std::vector<AssociationCandidate> result;
  for (std::size_t i = 0; i < forming_.size(); ++i) {
    const PlaneLandmark& plane = forming_[i].landmark;
    JointCovariance C = JointCovariance::Zero();
    if (plane.covariance) C.bottomRightCorner<3, 3>() = *plane.covariance;
    result.push_back({static_cast<PlaneId>(i), plane.plane_anchor, plane.anchor_map, C});
  }
  return result;
}

std::optional<std::size_t> PlaneFormation::match(
    const WorkingMap& map, const PlaneEvidence& evidence, std::int64_t track, const SE3& T_map_body,
    const std::vector<AssociationCandidate>& young) const {
  const AssociationOptions& options = map.options.association;
  for (std::size_t i = 0; i < forming_.size(); ++i) {
    if (track < 0 || !forming_[i].tracks.count(track)) continue;
    const auto match =
        associate(evidence, T_map_body, std::span(&young[i], 1), when_followed(options));
    if (match.plane != PlaneId::kNone) return i;
  }
  const auto within = [&](std::vector<AssociationCandidate> near, double reach) {
    std::erase_if(near, [&](const AssociationCandidate& c) {
      return !touches(forming_[static_cast<std::size_t>(c.id)].evidence, evidence, T_map_body,
                      map.graph, reach);
    });
    return near;
  };
  const std::vector<AssociationCandidate> near = within(young, map.index.small_cell());
  // What was seen at this place comes before what may go on to here.
  constexpr double kHere = 0.1;  // m
  if (near.size() > 1 && !evidence.partial) {
    const auto match = associate(evidence, T_map_body, within(near, kHere), options);
    if (match.plane != PlaneId::kNone) return static_cast<std::size_t>(match.plane);
  }
  const auto match = associate(evidence, T_map_body, near, options);
  if (match.plane == PlaneId::kNone) return std::nullopt;
  return static_cast<std::size_t>(match.plane);
}

std::optional<PlaneId> PlaneFormation::followed(const Graph& graph, std::int64_t track) const {
  const auto link = tracks_.find(track);
  if (track < 0 || link == tracks_.end()) return std::nullopt;
  const PlaneLandmark* plane = graph.find(successor_of(graph, link->second.plane));
  if (!plane || !plane->active) return std::nullopt;
  return plane->id;
}

void PlaneFormation::link(std::int64_t track, PlaneId plane, KeyframeId now) {
  if (track >= 0) tracks_[track] = {plane, now};
}

void PlaneFormation::add(const WorkingMap& map, std::optional<std::size_t> which,
                         const PlaneEvidence& evidence, std::int64_t track, Timestamp stamp) {
  FormingPlane& t = which ? forming_[*which] : forming_.emplace_back();
  const auto [known, first] = t.evidence.try_emplace(map.keyframe, evidence);
  if (!first) known->second.join(evidence);
  if (t.landmark.observations == 0) t.landmark.first_seen = stamp;
  t.landmark.last_seen = stamp;
  ++t.landmark.observations;
  t.landmark.votes.floor += evidence.votes.floor;
  t.landmark.votes.sub_dominant += evidence.votes.sub_dominant;
  t.landmark.votes.obstacle += evidence.votes.obstacle;
  t.last = map.keyframe;
  if (track >= 0) t.tracks.insert(track);
  refit_one(t, map);
}

std::vector<PlaneId> PlaneFormation::promote(WorkingMap& map) {
  std::vector<PlaneId> made;
  for (auto& forming : forming_) {
    if (forming.landmark.observations < map.options.min_observations) continue;
    if (const auto id = promote(map, forming)) made.push_back(*id);
  }
  return made;
}

std::optional<PlaneId> PlaneFormation::promote(WorkingMap& map, FormingPlane& t) {
  if (t.evidence.empty()) return std::nullopt;
  PlaneLandmark landmark = t.landmark;
  landmark.covariance.reset();  // the window's to say
  landmark.T_map_outline = plane_frame(landmark.plane_map(), landmark.anchor_map);
  landmark.outline = OutlineGrid(map.options.outline_cell_m);
  const PlaneId id = map.graph.add_plane(std::move(landmark));
  PlaneLandmark& plane = map.graph.at(id);
  map.window.add_plane(id, plane.plane_anchor, plane.anchor_map);
  bool partial = true;
  for (const auto& [keyframe, views] : t.evidence) {
    const Keyframe* from = map.graph.find(keyframe);
    if (from == nullptr) continue;
    partial = partial && views.partial();
    const PlaneMomentsFactor factor = factor_of(keyframe, id, views, map.options.association);
    map.graph.plane_moments.push_back(factor);
    map.window.add(factor);
    map.add_outline(plane, *from, views.best().outline_body);
    if (keyframe == map.keyframe) map.gathered.emplace(id, views);
  }
  for (const std::int64_t track : t.tracks) link(track, id, map.keyframe);
  const bool open = t.tilt_sigma > map.options.prior_tilt();
  if (partial && !open) map.partial.insert(id);
  if (open) {  // until the window says better: its tilt may be anything
    JointCovariance C = JointCovariance::Zero();
    C.bottomRightCorner<3, 3>() = t.landmark.covariance.value_or(Eigen::Matrix3d::Zero());
    C.bottomRightCorner<3, 3>().diagonal().array() += 1e-4;
    map.joint[id] = C;
  }
  // Directions that nothing may ever measure are held, in the window and in the graph alike.
  map.hold(id, plane.plane_anchor, t.tilt_sigma, map.options.prior_distance_m);
  t.evidence.clear();
  map.hold_first_floor(id);
  return id;
}

void PlaneFormation::forget(KeyframeId now, std::int64_t keyframes) {
  const auto forgotten = [&](KeyframeId last) {
    return static_cast<std::int64_t>(now) - static_cast<std::int64_t>(last) > keyframes;
  };
  std::erase_if(forming_, [&](const auto& t) { return t.evidence.empty() || forgotten(t.last); });
  std::erase_if(tracks_, [&](const auto& link) { return forgotten(link.second.last); });
}

void PlaneFormation::refit(const WorkingMap& map) {
  for (auto& forming : forming_) refit_one(forming, map);
}

}  // namespace lamina
