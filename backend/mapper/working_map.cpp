// Evidence joins planes; graph, window, outlines and index change together.
#include <lamina/backend/mapper/working_map.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/backend/mapper/plane_information.hpp>
#include <lamina/models/error.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;

const MapperOptions& checked(const MapperOptions& options) {
  const auto problems = options.problems();
  if (!problems.empty()) throw Error(problems.front());
  return options;
}

std::vector<Eigen::Vector3d> in_map(const SE3& T, const std::vector<Eigen::Vector3d>& points) {
  std::vector<Eigen::Vector3d> all;
  for (const auto& p : points) all.push_back(T * p);
  return all;
}

void ensure_in_window(WorkingMap& map, PlaneId id, const PlaneEvidence& evidence) {
  if (map.window.contains(id)) return;
  const PlaneLandmark& plane = map.graph.at(id);
  if (map.window.add_plane(id, plane.plane_anchor, plane.anchor_map, plane.covariance)) return;
  if (!map.partial.count(id)) return;
  // Upright on the scan, as when it was new. About its present tilt the prior would follow every
  // return's noise, and after many a wall would lie flat in the scan, where it fits all there is.
  const Plane& now = plane.plane_anchor;
  Eigen::Vector3d upright = now.normal();
  if (evidence.partial) {
    const Eigen::Vector3d scan = map.T_map_keyframe().so3() * evidence.scan_normal_body;
    upright -= upright.dot(scan) * scan;
  }
  const auto at = Plane::from_normal_rho(upright, now.rho() * upright.norm());
  map.window.add_prior(id, at.value_or(now), map.options.prior_tilt(),
                       map.options.prior_distance_m);
}

}  // namespace

WorkingMap::WorkingMap(const MapperOptions& o)
    : options(checked(o)),
      window(o.window),
      index(o.association.max_gap_m),
      surfels(o.surfel_cell_m) {}

JointCovariance WorkingMap::relative_covariance(PlaneId id) const {
  const auto known = joint.find(id);
  if (known != joint.end()) return known->second;
  // Not in the window at its last solution: what is known of both apart.
  JointCovariance C = JointCovariance::Zero();
  C.topLeftCorner<6, 6>() = keyframe_covariance;
  const PlaneLandmark& plane = graph.at(id);
  if (window.contains(id)) {
    C.topLeftCorner<6, 6>().setZero();  // new: it started from this keyframe
    C.bottomRightCorner<3, 3>().diagonal() << 1e-4, 1e-4, 1e-4;
  } else if (plane.covariance) {
    C.bottomRightCorner<3, 3>() = *plane.covariance;
  }
  return C;
}

void WorkingMap::observe(PlaneId id, const PlaneEvidence& evidence, Timestamp stamp) {
  ensure_in_window(*this, id, evidence);
  PlaneLandmark& plane = graph.at(id);
  const auto [known, first] = gathered.try_emplace(id, evidence);
  if (first) {
    graph.plane_moments.push_back({keyframe, id, {}});
    // One outline a keyframe: more of the same view adds nothing.
    add_outline(plane, graph.at(keyframe), evidence.outline_body);
  } else {
    known->second.join(evidence);
  }
  auto factor =
      std::find_if(graph.plane_moments.rbegin(), graph.plane_moments.rend(),
                   [&](const auto& f) { return f.keyframe == keyframe && f.plane == id; });
  if (factor == graph.plane_moments.rend()) {
    // A refinement since gave what the keyframe had seen to another plane: begun anew.
    known->second = PlaneViews(evidence);
    graph.plane_moments.push_back({keyframe, id, {}});
    factor = graph.plane_moments.rbegin();
  }
  const double weight = factor->weight;
  *factor = factor_of(keyframe, id, known->second, options.association);
  factor->weight = weight;
  window.set(*factor);
  ++plane.observations;
  plane.last_seen = std::max(plane.last_seen, stamp);
  plane.votes.floor += evidence.votes.floor;
  plane.votes.sub_dominant += evidence.votes.sub_dominant;
  plane.votes.obstacle += evidence.votes.obstacle;
  if (!evidence.partial) partial.erase(id);
}

void WorkingMap::add_outline(PlaneLandmark& plane, const Keyframe& from,
                             const std::vector<Eigen::Vector3d>& outline_body) {
  const auto points = in_map(from.T_map_body, outline_body);
  grow_outline(plane, points);
  outlines[plane.id].push_back({from.id, outline_body});
  index.insert_outline(plane.id, points);
}

bool WorkingMap::hold(PlaneId id, const Plane& at, double sigma_tilt, double sigma_rho) {
  if (!window.add_prior(id, at, sigma_tilt, sigma_rho)) return false;
  MarginalPrior prior;
  prior.planes = {id};
  prior.planes_linear = {at};
  prior.sqrt_information =
      Eigen::Vector3d(1 / sigma_tilt, 1 / sigma_tilt, 1 / sigma_rho).asDiagonal();
  prior.residual = Eigen::Vector3d::Zero();
  graph.marginal_priors.push_back(std::move(prior));
  return true;
}

void WorkingMap::hold_first_floor(PlaneId id) {
  constexpr double kMostTilt = 6 * kDegree, kMostHeight = 0.15, kMostDistance = 8;
  if (first_floor != PlaneId::kNone || !first_floor_map) return;
  const PlaneLandmark& plane = graph.at(id);
  const bool floor = plane.votes.floor > 0 && plane.votes.floor >= plane.votes.sub_dominant &&
                     plane.votes.floor >= plane.votes.obstacle;
  const Plane plane_map = plane.plane_map();
  const Eigen::Vector3d start = graph.keyframes.front().T_map_body.translation();
  if (!floor || !(angle_between(plane_map, *first_floor_map) < kMostTilt) ||
      !(std::abs(plane_map.rho_at(first_floor_map->project(start))) < kMostHeight) ||
      !((plane.anchor_map - start).norm() < kMostDistance)) {
    return;
  }
  const Plane level = first_floor_map->about(plane.anchor_map);
  // Where ground swells a body stands as tilted and as high as that is.
  const double rough = options.ground.enabled && ground.swells() ? ground.roughness() : 0;
  const double tilt =
      std::hypot(options.first_floor_tilt_deg * kDegree, 2 * rough / options.ground.correlation_m);
  if (hold(id, level, tilt, std::hypot(options.first_floor_height_m, rough))) {
    first_floor = id;
  }
}

void WorkingMap::take_window_estimates() {
  for (const KeyframeId id : window.keyframes()) graph.at(id).T_map_body = window.pose(id);
  for (const PlaneId id : window.planes()) {
    graph.at(id).set_plane_anchor(window.plane_anchor(id));
  }
  keyframe_covariance = window.newest_covariance();
  joint.clear();
  for (const auto& [id, C] : window.joint_covariances(window.planes())) joint.emplace(id, C);
}

void WorkingMap::remake_outlines() {
  index.clear();
  for (auto& plane : graph.planes) {
    if (!plane.active) continue;
    remake_outline(plane, outlines[plane.id], graph, options.outline_cell_m);
    for (const auto& piece : outlines[plane.id]) {
      const Keyframe* from = graph.find(piece.keyframe);
      if (from) index.insert_outline(plane.id, in_map(from->T_map_body, piece.points_body));
    }
  }
}

void WorkingMap::replace_keyframe(KeyframeId gone, KeyframeId into, const SE3& T_into_gone) {
  frames.transfer(gone, into, T_into_gone);
  left_window.erase(gone);  // its frames take the other's
  surfels.transfer(gone, into, T_into_gone);
  loose_body.erase(gone);
  for (auto& [plane, pieces] : outlines) {
    std::erase_if(pieces, [gone](const OutlinePiece& p) { return p.keyframe == gone; });
  }
  graph.remove(gone);
}

void WorkingMap::move(const SE3& T_new_map) {
  for (auto& [id, C] : joint) {
    // Pose errors are the body's own: they stay. Those of the plane turn with its tangent.
    JointCovariance M = JointCovariance::Identity();
    M.bottomRightCorner<3, 3>() =
        Plane::tangent_turn(T_new_map.so3(), graph.at(id).plane_anchor.normal());
    C = (M * C * M.transpose()).eval();
  }
  graph.move(T_new_map);
  for (auto& [id, T_map_body] : left_window) T_map_body = T_new_map * T_map_body;
  if (first_floor_map) first_floor_map = T_new_map * *first_floor_map;
  window.move(T_new_map);
  remake_outlines();
}

PlaneId successor_of(const Graph& graph, PlaneId id) {
  const PlaneLandmark* plane = graph.find(id);
  while (plane && !plane->active && plane->merged_into != PlaneId::kNone) {
    plane = graph.find(plane->merged_into);
  }
  return plane ? plane->id : PlaneId::kNone;
}

}  // namespace lamina
