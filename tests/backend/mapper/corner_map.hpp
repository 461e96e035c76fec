// A map of a floor and two walls that one keyframe saw, to try parts of the mapper alone.
#pragma once

#include <array>
#include <vector>

#include <lamina/backend/mapper/working_map.hpp>

namespace lamina::made_up {

// A square of 2 m on each of three planes, the normals towards (0, 0, 1).
inline const std::array<Plane, 3>& corner_planes() {
  static const std::array<Plane, 3> planes{Plane({0, 0, 1}, 0), Plane({-1, 0, 0}, -3),
                                           Plane({0, -1, 0}, -3)};
  return planes;
}

// What a body at T_map_body sees of the plane, 1 cm of noise as its weights say.
inline PlaneEvidence evidence_of(const Plane& plane, const SE3& T_map_body) {
  const SE3 T_body_map = T_map_body.inverse();
  const Eigen::Vector3d middle = plane.project({0, 0, 1});
  const Matrix32d B = plane.tangent_basis();
  PlaneEvidence evidence;
  evidence.plane_body = T_body_map * plane;
  for (double u = -1; u <= 1; u += 0.1) {
    for (double v = -1; v <= 1; v += 0.1) {
      evidence.moments_body.add(T_body_map * (middle + B * Eigen::Vector2d(u, v)), 1e4);
    }
  }
  for (const auto& [u, v] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    evidence.outline_body.push_back(T_body_map * (middle + B * Eigen::Vector2d(u, v)));
  }
  return evidence;
}

inline KeyframeId add_keyframe(WorkingMap& map, const SE3& T_map_body) {
  const auto stamp =
      Timestamp::from_nanoseconds(100000000LL * (1 + static_cast<int>(map.keyframe)));
  map.keyframe = map.graph.add_keyframe(stamp, T_map_body);
  map.window.add_keyframe(map.keyframe, stamp, T_map_body);
  map.gathered.clear();
  return map.keyframe;
}

// A plane new to the map, seen by the present keyframe.
inline PlaneId add_plane(WorkingMap& map, const Plane& plane) {
  const PlaneId id = map.graph.add_plane(PlaneLandmark::at(plane, {0, 0, 1}));
  const PlaneLandmark& made = map.graph.at(id);
  map.window.add_plane(id, made.plane_anchor, made.anchor_map);
  map.observe(id, evidence_of(plane, map.T_map_keyframe()), map.graph.at(map.keyframe).stamp);
  return id;
}

// Ids 0, 1, 2 as corner_planes().
inline WorkingMap make_corner() {
  WorkingMap map{MapperOptions()};
  add_keyframe(map, SE3());
  for (const Plane& plane : corner_planes()) add_plane(map, plane);
  return map;
}

}  // namespace lamina::made_up
