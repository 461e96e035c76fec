// The map and the paths, by present estimates.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>

#include <lamina/backend/association/outline_split.hpp>
#include <lamina/backend/consistency/ground_strokes.hpp>
#include <lamina/backend/consistency/opening_split.hpp>
#include <lamina/backend/consistency/plane_creases.hpp>
#include <lamina/backend/consistency/plane_ghosts.hpp>
#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/backend/parameters/mounting_covariance.hpp>
#include <lamina/backend/solver/covariance.hpp>
#include <lamina/models/linalg.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;

void append(std::vector<std::string>& all, const std::vector<std::string>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

// What a plane's own evidence says of its tangent about its anchor, poses given.
Eigen::Matrix3d own_information(const Graph& graph, const PlaneLandmark& plane) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  const Matrix32d B = plane.plane_anchor.tangent_basis();
  for (const auto& f : graph.plane_moments) {
    if (f.plane != plane.id) continue;
    const Keyframe* keyframe = graph.find(f.keyframe);
    if (!keyframe) continue;
    const Moments m = f.moments_body.transformed(keyframe->T_map_body);
    H.topLeftCorner<2, 2>() += f.weight * (B.transpose() * m.scatter() * B);
    Eigen::Vector3d along;
    along << B.transpose() * (m.mean() - plane.anchor_map), -1;
    H += f.weight * m.weight() * along * along.transpose();
  }
  return H;
}

// In how many directions `H` leaves a prior of these square roots of information at more than
// `share` of its sigma.
int unobserved(const Eigen::Matrix3d& H, const Eigen::Vector3d& prior, double share) {
  const Eigen::Vector3d scale = prior.cwiseInverse();
  const Eigen::Matrix3d relative = scale.asDiagonal() * H * scale.asDiagonal();
  const SymmetricEigen<3> eigen = symmetric_eigen(relative);
  // sigma / sigma of the prior = 1 / sqrt(1 + information in units of the prior's).
  const double least = 1 / (share * share) - 1;
  int directions = 0;
  for (int k = 0; k < 3; ++k) directions += eigen.values(k) < least ? 1 : 0;
  return directions;
}

}  // namespace

std::vector<std::string> MapperOptions::problems() const {
  std::vector<std::string> result;
  append(result, window.problems());
  append(result, association.problems());
  append(result, place.problems());
  append(result, labels.problems());
  const auto positive = [&result](double value, const char* name) {
    if (!(value > 0)) result.push_back(std::string("mapper.") + name + ": expected more than 0");
  };
  positive(keyframe_distance_m, "keyframe_distance_m");
  positive(keyframe_angle_deg, "keyframe_angle_deg");
  positive(keyframe_new_share, "keyframe_new_share");
  positive(min_observations, "min_observations");
  positive(forget_keyframes, "forget_keyframes");
  positive(prior_tilt_deg, "prior_tilt_deg");
  positive(prior_distance_m, "prior_distance_m");
  positive(unobserved_share, "unobserved_share");
  positive(outline_cell_m, "outline_cell_m");
  positive(surfel_cell_m, "surfel_cell_m");
  positive(surfel_parent_sigma_m, "surfel_parent_sigma_m");
  positive(surfel_parent_slope_deg, "surfel_parent_slope_deg");
  return result;
}

Mapper::Mapper(const MapperOptions& options, MapState map) : Mapper(options) {
  graph_ = std::move(map.graph);
  for (const MapFrame& frame : map.frames) frames_.add(frame);
  left_window_ = std::move(map.left_window);
  outlines_ = std::move(map.outlines);
  partial_ = std::move(map.partial);
  surfels_ = std::move(map.surfels);
  loose_body_ = std::move(map.loose_body);
  extrinsics_covariance_ = map.extrinsics_covariance;
  if (!graph_.keyframes.empty()) condensed_ = graph_.keyframes.back().id;
  set_wheel_covariance(map.wheel_covariance);
}

MapState Mapper::state() const {
  MapState map{graph_,   {},          left_window_,           outlines_,        partial_,
               surfels_, loose_body_, extrinsics_covariance_, wheel_covariance_};
  map.frames.reserve(frames_.size());
  frames_.for_each([&map](const MapFrame& frame) { map.frames.push_back(frame); });
  for (const auto& [id, joint] : joint_) {
    PlaneLandmark* plane = map.graph.find(id);
    if (plane) plane->covariance = joint.bottomRightCorner<3, 3>();
  }
  return map;
}

MapPlane Mapper::map_plane(const PlaneLandmark& plane) const {
  MapPlane result;
  result.id = static_cast<std::int64_t>(plane.id);
  result.plane_map = plane.plane_map();
  result.centroid_map = result.plane_map.project(outline_centroid_map(plane));
  result.outlines_map = outlines_map(plane);
  result.ring_map = ring_map(plane);
  result.area = plane.outline.area();
  if (result.outlines_map.empty()) {
    PlaneLandmark viewed = plane;
    viewed.outline = outline_of_views(plane, graph_);
    result.outlines_map = outlines_map(viewed);
    result.ring_map = ring_map(viewed);
    result.area = viewed.outline.area();
  }
  result.observations = plane.observations;
  result.first_seen = plane.first_seen;
  result.last_seen = plane.last_seen;
  const double tilt = 1 / (options_.prior_tilt_deg * kDegree), rho = 1 / options_.prior_distance_m;
  const Eigen::Vector3d prior(tilt, tilt, rho);
  Eigen::Matrix3d H = own_information(graph_, plane);
  result.unobserved_directions = unobserved(H, prior, options_.unobserved_share);
  H.diagonal() += prior.cwiseAbs2();
  Eigen::Matrix3d C = H.llt().solve(Eigen::Matrix3d::Identity());
  const auto joint = joint_.find(plane.id);
  if (joint != joint_.end()) {
    C = joint->second.bottomRightCorner<3, 3>();
  } else if (plane.covariance) {
    C = *plane.covariance;
  }
  const auto by_wheels = by_wheels_.planes.find(plane.id);
  if (by_wheels != by_wheels_.planes.end()) C += by_wheels->second;
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();  // from the anchor to the centroid
  J.bottomLeftCorner<1, 2>() =
      -(result.centroid_map - plane.anchor_map).transpose() * plane.plane_anchor.tangent_basis();
  result.covariance = J * C * J.transpose();
  return result;
}

// Keyframes with floor that lie where the last refinement put them: what came after it does not lie
// where the next one will.
std::vector<KeyframeId> Mapper::laid_out_floor() const {
  std::vector<KeyframeId> result = surfels_.keyframes();
  std::erase_if(result, [this](KeyframeId id) { return id > refined_ || window_.contains(id); });
  return result;
}

void Mapper::condense_floor(double radius_m) {
  surfels_.condense(graph_, laid_out_floor(), radius_m);
  successors_.clear();
}

void Mapper::condense_newest_floor(double radius_m) {
  condense_floor_about(std::exchange(successors_, {}), radius_m);
  // Those before them see the same floor: as many as reach as far as the camera does.
  constexpr std::int64_t kSeam = 25;  // some 10 m
  const auto last = static_cast<std::int64_t>(condensed_);
  const KeyframeId known =
      std::max(refined_, static_cast<KeyframeId>(std::max<std::int64_t>(-1, last - kSeam)));
  std::vector<KeyframeId> newest = surfels_.keyframes();
  std::erase_if(newest, [&](KeyframeId id) { return id <= known || window_.contains(id); });
  if (newest.empty() || newest.back() <= condensed_) return;
  surfels_.condense(graph_, newest, radius_m);
  condensed_ = newest.back();
}

// What these hold, with that of others which see the same floor.
void Mapper::condense_floor_about(const std::set<KeyframeId>& keyframes, double radius_m) {
  double reach = 0;
  std::vector<Eigen::Vector3d> places;
  for (const KeyframeId id : keyframes) {
    const Keyframe* keyframe = graph_.find(id);
    if (keyframe == nullptr || id > refined_) continue;
    places.push_back(keyframe->T_map_body.translation());
    reach = std::max(reach, surfels_.reach(id));
  }
  if (places.empty()) return;
  std::vector<KeyframeId> about = laid_out_floor();
  std::erase_if(about, [&](KeyframeId id) {
    const Keyframe* keyframe = graph_.find(id);
    return keyframe == nullptr || std::none_of(places.begin(), places.end(), [&](const auto& p) {
             return (keyframe->T_map_body.translation() - p).norm() < 2 * reach;
           });
  });
  surfels_.condense(graph_, about, radius_m);
}

void Mapper::know_covariances() {
  store_covariances(graph_);
  joint_.clear();
  set_wheel_covariance(wheel_covariance_);
}

void Mapper::set_wheel_covariance(const Eigen::Matrix3d& covariance) {
  wheel_covariance_ = covariance;
  by_wheels_ = {};
  if (!covariance.isZero(0)) by_wheels_ = moved_by_wheels(graph_, covariance);
}

std::optional<double> Mapper::path_sigma() const {
  CovarianceRequest request;
  for (const Keyframe& keyframe : graph_.keyframes) request.keyframes.push_back(keyframe.id);
  const Covariances found = covariances(graph_, request);
  if (!found.valid || request.keyframes.empty()) return std::nullopt;
  double sum = 0;
  for (std::size_t i = 0; i < found.keyframes.size(); ++i) {
    sum += found.keyframes[i].topLeftCorner<3, 3>().trace();
    if (i < by_wheels_.keyframes.size())
      sum += by_wheels_.keyframes[i].topLeftCorner<3, 3>().trace();
  }
  return std::sqrt(sum / static_cast<double>(found.keyframes.size()));
}

void Mapper::drop_strokes_on_ground(std::vector<MapPlane>& planes) const {
  std::vector<const PlaneLandmark*> ground;
  for (const MapPlane& plane : planes) {
    const auto id = static_cast<PlaneId>(plane.id);
    const bool label = plane.label == PlaneLabel::kFloor || plane.label == PlaneLabel::kRamp ||
                       plane.label == PlaneLabel::kStep;
    if (label && !partial_.count(id)) ground.push_back(&graph_.at(id));
  }
  std::erase_if(planes, [&](const MapPlane& plane) {
    const auto id = static_cast<PlaneId>(plane.id);
    const auto strokes = outlines_.find(id);
    return partial_.count(id) && strokes != outlines_.end() &&
           lies_on_ground(strokes->second, graph_, ground);
  });
}

// What one plane says of several walls, each by itself; the largest keeps the plane's id.
void Mapper::part_walls(std::vector<MapPlane>& planes) const {
  std::int64_t next_id = 0;
  for (const auto& plane : graph_.planes) {
    next_id = std::max(next_id, static_cast<std::int64_t>(plane.id) + 1);
  }
  std::vector<MapPlane> more;
  const auto apart = walls_apart(graph_, outlines_, options_.association.max_gap_m);
  for (MapPlane& plane : planes) {
    const auto walls = apart.find(static_cast<PlaneId>(plane.id));
    if (walls == apart.end()) continue;
    std::vector<MapPlane> parts;
    for (const OutlineGrid& outline : walls->second) {
      MapPlane& part = parts.emplace_back(map_plane(part_of(walls->first, outline)));
      part.label = plane.label;
    }
    std::stable_sort(parts.begin(), parts.end(),
                     [](const MapPlane& a, const MapPlane& b) { return a.area > b.area; });
    plane = parts.front();
    for (std::size_t i = 1; i < parts.size(); ++i) {
      parts[i].id = next_id++;
      more.push_back(std::move(parts[i]));
    }
  }
  std::move(more.begin(), more.end(), std::back_inserter(planes));
}

// The plane as if only this part of its outline had been seen. How often, is told by how many of
// the keyframes that saw the plane saw this part.
PlaneLandmark Mapper::part_of(PlaneId id, const OutlineGrid& outline) const {
  PlaneLandmark part = graph_.at(id);
  part.outline = outline;
  const SE3 T_outline_map = part.T_map_outline.inverse();
  std::set<KeyframeId> all, these;
  for (const OutlinePiece& piece : outlines_.at(id)) {
    const Keyframe* keyframe = graph_.find(piece.keyframe);
    if (!keyframe) continue;
    all.insert(piece.keyframe);
    const SE3 T_outline_body = T_outline_map * keyframe->T_map_body;
    for (const auto& p : sample_outline(piece.points_body, outline.cell_size())) {
      if (!outline.contains((T_outline_body * p).head<2>())) continue;
      these.insert(piece.keyframe);
      break;
    }
  }
  if (these.empty()) return part;
  const double share = static_cast<double>(these.size()) / static_cast<double>(all.size());
  part.observations =
      std::max<std::int64_t>(1, std::llround(share * static_cast<double>(part.observations)));
  const auto stamp = [this](KeyframeId keyframe) { return graph_.at(keyframe).stamp; };
  part.first_seen = stamp(*these.begin());
  part.last_seen = stamp(*these.rbegin());
  return part;
}

PlanarMap Mapper::map() const {
  PlanarMap map;
  map.trajectory = trajectory();
  for (const auto& plane : graph_.planes) {
    if (plane.active) map.planes.push_back(map_plane(plane));
  }
  // Of which nothing is left that saw them: nobody knows where they are.
  std::erase_if(map.planes, [](const MapPlane& plane) { return plane.outlines_map.empty(); });
  label_planes(map.planes, map.trajectory, options_.labels);
  drop_strokes_on_ground(map.planes);
  std::set<PlaneId> none = creases(graph_, outlines_);
  none.merge(ghosts(graph_, outlines_));
  std::erase_if(map.planes, [&none](const MapPlane& plane) {
    return none.count(static_cast<PlaneId>(plane.id)) > 0;
  });
  part_walls(map.planes);
  for (MapPlane& plane : map.planes) {
    plane.covariance_mounting =
        by_mounting(extrinsics_covariance_, graph_.keyframes.front().T_map_body, plane.plane_map,
                    plane.centroid_map);
  }
  SurfelOptions options;
  options.cell_m = options_.surfel_cell_m;
  options.parent_sigma_m = options_.surfel_parent_sigma_m;
  options.parent_slope = std::tan(options_.surfel_parent_slope_deg * kDegree);
  const SurfelFloor floor = surfels_.solve(graph_, options);
  for (const auto& [key, cell] : floor.cells()) map.surfels.push_back(floor.surfel(key));
  for (const auto& [id, points] : loose_body_) {
    const Keyframe* keyframe = graph_.find(id);
    if (!keyframe) continue;
    for (const auto& p : points) map.loose_points.push_back(keyframe->T_map_body * p);
  }
  return map;
}

Trajectory Mapper::trajectory() const {
  Trajectory path;
  frames_.for_each([&](const MapFrame& frame) {
    path.add(frame.stamp, graph_.at(frame.keyframe).T_map_body * frame.T_keyframe_body);
  });
  return path;
}

Trajectory Mapper::online_trajectory() const {
  Trajectory path;
  frames_.for_each([&](const MapFrame& frame) {
    const auto left = left_window_.find(frame.keyframe);
    const SE3& T = left == left_window_.end() ? graph_.at(frame.keyframe).T_map_body : left->second;
    path.add(frame.stamp, T * frame.T_keyframe_body);
  });
  return path;
}

}  // namespace lamina
