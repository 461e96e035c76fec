// Planes of the graph as planes of a map.
#include <lamina/backend/mapper/map_drawing.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>

#include <lamina/backend/association/outline_split.hpp>
#include <lamina/backend/consistency/ground_strokes.hpp>
#include <lamina/backend/consistency/opening_split.hpp>
#include <lamina/backend/consistency/plane_creases.hpp>
#include <lamina/backend/consistency/plane_ghosts.hpp>
#include <lamina/backend/parameters/mounting_covariance.hpp>
#include <lamina/backend/solver/covariance.hpp>
#include <lamina/models/linalg.hpp>

namespace lamina {
namespace {

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

MapPlane map_plane(const WorkingMap& map, const ParameterUncertainty& parameters,
                   const PlaneLandmark& plane) {
  MapPlane result;
  result.id = static_cast<std::int64_t>(plane.id);
  result.plane_map = plane.plane_map();
  result.centroid_map = result.plane_map.project(outline_centroid_map(plane));
  result.outlines_map = outlines_map(plane);
  result.ring_map = ring_map(plane);
  result.area = plane.outline.area();
  if (result.outlines_map.empty()) {
    PlaneLandmark viewed = plane;
    viewed.outline = outline_of_views(plane, map.graph);
    result.outlines_map = outlines_map(viewed);
    result.ring_map = ring_map(viewed);
    result.area = viewed.outline.area();
  }
  result.observations = plane.observations;
  result.first_seen = plane.first_seen;
  result.last_seen = plane.last_seen;
  const double tilt = 1 / map.options.prior_tilt(), rho = 1 / map.options.prior_distance_m;
  const Eigen::Vector3d prior(tilt, tilt, rho);
  Eigen::Matrix3d H = own_information(map.graph, plane);
  result.unobserved_directions = unobserved(H, prior, map.options.unobserved_share);
  H.diagonal() += prior.cwiseAbs2();
  Eigen::Matrix3d C = H.llt().solve(Eigen::Matrix3d::Identity());
  const auto joint = map.joint.find(plane.id);
  if (joint != map.joint.end()) {
    C = joint->second.bottomRightCorner<3, 3>();
  } else if (plane.covariance) {
    C = *plane.covariance;
  }
  const auto by_wheels = parameters.by_wheels.planes.find(plane.id);
  if (by_wheels != parameters.by_wheels.planes.end()) C += by_wheels->second;
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();  // from the anchor to the centroid
  J.bottomLeftCorner<1, 2>() =
      -(result.centroid_map - plane.anchor_map).transpose() * plane.plane_anchor.tangent_basis();
  result.covariance = J * C * J.transpose();
  return result;
}

// What level scans drew where the ground rises into their plane is ground.
void drop_strokes_on_ground(const WorkingMap& map, std::vector<MapPlane>& planes) {
  std::vector<const PlaneLandmark*> ground;
  for (const MapPlane& plane : planes) {
    const auto id = static_cast<PlaneId>(plane.id);
    const bool label = plane.label == PlaneLabel::kFloor || plane.label == PlaneLabel::kRamp ||
                       plane.label == PlaneLabel::kStep;
    if (label && !map.partial.count(id)) ground.push_back(&map.graph.at(id));
  }
  std::erase_if(planes, [&](const MapPlane& plane) {
    const auto id = static_cast<PlaneId>(plane.id);
    const auto strokes = map.outlines.find(id);
    return map.partial.count(id) && strokes != map.outlines.end() &&
           lies_on_ground(strokes->second, map.graph, ground);
  });
}

// The plane as if only this part of its outline had been seen. How often, is told by how many of
// the keyframes that saw the plane saw this part.
PlaneLandmark part_of(const WorkingMap& map, PlaneId id, const OutlineGrid& outline) {
  PlaneLandmark part = map.graph.at(id);
  part.outline = outline;
  const SE3 T_outline_map = part.T_map_outline.inverse();
  std::set<KeyframeId> all, these;
  for (const OutlinePiece& piece : map.outlines.at(id)) {
    const Keyframe* keyframe = map.graph.find(piece.keyframe);
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
  const auto stamp = [&map](KeyframeId keyframe) { return map.graph.at(keyframe).stamp; };
  part.first_seen = stamp(*these.begin());
  part.last_seen = stamp(*these.rbegin());
  return part;
}

// What one plane says of several walls, each by itself; the largest keeps the plane's id.
void part_walls(const WorkingMap& map, const ParameterUncertainty& parameters,
                std::vector<MapPlane>& planes) {
  std::int64_t next_id = 0;
  for (const auto& plane : map.graph.planes) {
    next_id = std::max(next_id, static_cast<std::int64_t>(plane.id) + 1);
  }
  std::vector<MapPlane> more;
  const auto apart = walls_apart(map.graph, map.outlines, map.options.association.max_gap_m);
  for (MapPlane& plane : planes) {
    const auto walls = apart.find(static_cast<PlaneId>(plane.id));
    if (walls == apart.end()) continue;
    std::vector<MapPlane> parts;
    for (const OutlineGrid& outline : walls->second) {
      MapPlane& part =
          parts.emplace_back(map_plane(map, parameters, part_of(map, walls->first, outline)));
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

}  // namespace

void ParameterUncertainty::set_wheels(const Graph& graph, const Eigen::Matrix3d& covariance) {
  wheels = covariance;
  by_wheels = {};
  if (!covariance.isZero(0)) by_wheels = moved_by_wheels(graph, covariance);
}

PlanarMap draw_map(const WorkingMap& map, const ParameterUncertainty& parameters) {
  PlanarMap result;
  result.trajectory = draw_path(map);
  for (const auto& plane : map.graph.planes) {
    if (plane.active) result.planes.push_back(map_plane(map, parameters, plane));
  }
  // Of which nothing is left that saw them: nobody knows where they are.
  std::erase_if(result.planes, [](const MapPlane& plane) { return plane.outlines_map.empty(); });
  label_planes(result.planes, result.trajectory, map.options.labels);
  drop_strokes_on_ground(map, result.planes);
  std::set<PlaneId> none = creases(map.graph, map.outlines);
  none.merge(ghosts(map.graph, map.outlines));
  std::erase_if(result.planes, [&none](const MapPlane& plane) {
    return none.count(static_cast<PlaneId>(plane.id)) > 0;
  });
  part_walls(map, parameters, result.planes);
  for (MapPlane& plane : result.planes) {
    plane.covariance_mounting =
        by_mounting(parameters.extrinsics, map.graph.keyframes.front().T_map_body, plane.plane_map,
                    plane.centroid_map);
  }
  SurfelOptions options;
  options.cell_m = map.options.surfel_cell_m;
  options.parent_sigma_m = map.options.surfel_parent_sigma_m;
  options.parent_slope = std::tan(map.options.surfel_parent_slope_deg * (M_PI / 180.0));
  const SurfelFloor floor = map.surfels.solve(map.graph, options);
  for (const auto& [key, cell] : floor.cells()) result.surfels.push_back(floor.surfel(key));
  for (const auto& [id, points] : map.loose_body) {
    const Keyframe* keyframe = map.graph.find(id);
    if (!keyframe) continue;
    for (const auto& p : points) result.loose_points.push_back(keyframe->T_map_body * p);
  }
  return result;
}

Trajectory draw_path(const WorkingMap& map, bool as_left) {
  Trajectory path;
  map.frames.for_each([&](const MapFrame& frame) {
    const auto left = as_left ? map.left_window.find(frame.keyframe) : map.left_window.end();
    const SE3& T =
        left == map.left_window.end() ? map.graph.at(frame.keyframe).T_map_body : left->second;
    path.add(frame.stamp, T * frame.T_keyframe_body);
  });
  return path;
}

std::optional<double> path_sigma(const Graph& graph, const ParameterUncertainty& parameters) {
  CovarianceRequest request;
  for (const Keyframe& keyframe : graph.keyframes) request.keyframes.push_back(keyframe.id);
  const Covariances found = covariances(graph, request);
  if (!found.valid || request.keyframes.empty()) return std::nullopt;
  double sum = 0;
  for (std::size_t i = 0; i < found.keyframes.size(); ++i) {
    sum += found.keyframes[i].topLeftCorner<3, 3>().trace();
    if (i < parameters.by_wheels.keyframes.size())
      sum += parameters.by_wheels.keyframes[i].topLeftCorner<3, 3>().trace();
  }
  return std::sqrt(sum / static_cast<double>(found.keyframes.size()));
}

}  // namespace lamina
