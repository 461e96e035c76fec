// Planes of now against planes of before, several at once.
#include <lamina/backend/mapper/plane_loop.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/backend/association/place_recognition.hpp>

namespace lamina {
namespace {

RecognitionPlane recognition_plane(const PlaneLandmark& plane, const Eigen::Matrix3d& covariance) {
  RecognitionPlane result;
  result.id = plane.id;
  result.plane_map = plane.plane_map();
  result.middle_map = outline_centroid_map(plane);
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J.bottomLeftCorner<1, 2>() =
      -(result.middle_map - plane.anchor_map).transpose() * plane.plane_anchor.tangent_basis();
  result.covariance = J * covariance * J.transpose();
  // Drift that all planes share is the motion that is looked for; what is left is local.
  const double limit = 0.1 * 0.1;
  result.covariance *= std::min(1.0, limit / std::max(1e-12, result.covariance(2, 2)));
  return result;
}

// The part of a motion about a point that upright walls tell: in plan.
SE3 in_plan(const SE3& T, const Eigen::Vector3d& about) {
  const SO3 turn = SO3::rot_z(T.so3().yaw());
  Eigen::Vector3d to = T * about;
  to.z() = about.z();
  return {turn, to - turn * about};
}

std::optional<PlaceMatch> recognised(const WorkingMap& map) {
  std::vector<RecognitionPlane> fresh, old;
  for (const auto& [id, views] : map.gathered) {
    const auto joint = map.joint.find(id);
    const PlaneLandmark& plane = map.graph.at(id);
    if (joint == map.joint.end() || !plane.active) continue;
    fresh.push_back(recognition_plane(plane, joint->second.bottomRightCorner<3, 3>()));
  }
  if (fresh.size() < static_cast<std::size_t>(map.options.place.min_planes)) return std::nullopt;
  for (const auto& plane : map.graph.planes) {
    if (!plane.active || map.window.contains(plane.id) || !plane.covariance) continue;
    old.push_back(recognition_plane(plane, *plane.covariance));
  }
  const Eigen::Vector3d body = map.T_map_keyframe().translation();
  const double sigma = std::sqrt(map.keyframe_covariance.topLeftCorner<3, 3>().trace());
  return recognise_place(fresh, old, map.index, body, 0.5 + 3 * sigma, map.options.place);
}

// Whether a match is of upright walls that scans see as lines: how those lean, and so height and
// tilt, the prior says.
bool is_upright_lines(const WorkingMap& map, const PlaceMatch& match) {
  return std::all_of(match.pairs.begin(), match.pairs.end(), [&map](const auto& pair) {
    constexpr double kUpright = 0.3;
    return map.partial.count(pair.first) > 0 &&
           std::abs(map.graph.at(pair.first).plane_anchor.normal().z()) < kUpright;
  });
}

void move_window(WorkingMap& map, PlaneMerging& merging, const SE3& T_old_new,
                 const std::vector<std::pair<PlaneId, PlaneId>>& pairs) {
  map.window.move(T_old_new);
  for (const auto& [fresh, old] : pairs) {
    if (!map.graph.at(fresh).active || !map.graph.at(old).active) continue;
    if (map.window.contains(old)) {
      map.window.merge_planes(fresh, old);  // two new planes are one old plane
    } else {
      map.window.rename_plane(fresh, old);
    }
    merging.absorb(map, fresh, old);
  }
  for (const KeyframeId id : map.window.keyframes())
    map.graph.at(id).T_map_body = map.window.pose(id);
  for (const PlaneId id : map.window.planes()) {
    PlaneLandmark& plane = map.graph.at(id);
    map.window.set_anchor(id, plane.anchor_map);
    plane.set_plane_anchor(map.window.plane_anchor(id));
    // Seen in the window only: its outline moves along. Others are made anew by refine().
    std::vector<Eigen::Vector3d> points;
    for (const auto& piece : map.outlines[id]) {
      const Keyframe* keyframe = map.graph.find(piece.keyframe);
      if (!keyframe) continue;
      for (const auto& p : piece.points_body) points.push_back(keyframe->T_map_body * p);
    }
    remake_outline(plane, map.outlines[id], map.graph, map.options.outline_cell_m);
    map.index.insert(id, points);
  }
  map.joint.clear();
}

}  // namespace

bool close_plane_loop(WorkingMap& map, PlaneMerging& merging) {
  const auto match = recognised(map);
  if (!match) return false;
  const Eigen::Vector3d body = map.T_map_keyframe().translation();
  const SE3 T_old_new =
      is_upright_lines(map, *match) ? in_plan(match->T_old_new, body) : match->T_old_new;
  move_window(map, merging, T_old_new, match->pairs);
  return true;
}

}  // namespace lamina
