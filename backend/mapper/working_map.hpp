// A map in motion: what all parts of the mapper work on, and the methods that keep it consistent.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <vector>

#include <lamina/backend/association/connected_ground.hpp>
#include <lamina/backend/association/plane_evidence.hpp>
#include <lamina/backend/association/plane_index.hpp>
#include <lamina/backend/mapper/map_state.hpp>
#include <lamina/backend/mapper/mapper_options.hpp>
#include <lamina/backend/solver/window/sliding_window.hpp>

namespace lamina {

/// Of a body's pose in its right tangent (6) and a plane in its tangent about its anchor (3).
using JointCovariance = Eigen::Matrix<double, 9, 9>;

/// MapState in motion: beside what that keeps, the newest part of it as the window has it, and what
/// the present keyframe sees. A value.
struct WorkingMap {
  /// Throws lamina::Error where options cannot be.
  explicit WorkingMap(const MapperOptions& options);

  MapperOptions options;
  Graph graph;
  SlidingWindow window;
  PlaneIndex index;
  std::map<PlaneId, std::vector<OutlinePiece>> outlines;
  std::set<PlaneId> partial;  ///< planes seen by segments alone

  // ---- on keyframes
  FrameLog frames;
  std::map<KeyframeId, SE3> left_window;  ///< T_map_body as each keyframe left
  SurfelEvidence surfels;
  std::map<KeyframeId, std::vector<Eigen::Vector3d>> loose_body;

  // ---- the present keyframe
  KeyframeId keyframe = KeyframeId::kNone;
  Matrix6d keyframe_covariance = Matrix6d::Identity();  ///< of its pose, right tangent
  /// What it saw of planes, its body frame, undiscounted: the noise floor counts once however many
  /// frames join.
  std::map<PlaneId, PlaneViews> gathered;
  std::map<PlaneId, JointCovariance> joint;  ///< its pose and each plane's, at the last solution

  GroundWatch ground;  ///< whether the ground of late swells

  // ---- the floor under the first pose
  PlaneId first_floor = PlaneId::kNone;  ///< held where the frames say,
  std::optional<Plane> first_floor_map;  ///< which is here

  const SE3& T_map_keyframe() const { return graph.at(keyframe).T_map_body; }
  /// Of the present keyframe and a plane.
  JointCovariance relative_covariance(PlaneId id) const;

  /// One more view of a plane by the present keyframe (its body frame).
  void observe(PlaneId id, const PlaneEvidence& evidence, Timestamp stamp);
  /// What a keyframe saw of a plane joins its outline, and the index; `outline_body`: m.
  void add_outline(PlaneLandmark& plane, const Keyframe& keyframe,
                   const std::vector<Eigen::Vector3d>& outline_body);
  /// A prior on a plane about its anchor (rad, m), in the window and in the graph alike. False
  /// where the window does not have the plane.
  bool hold(PlaneId id, const Plane& at_anchor, double sigma_tilt, double sigma_rho);
  /// Holds the floor under the first pose, if `id` is that: frames say where it is.
  void hold_first_floor(PlaneId id);
  /// Keyframes and planes where the window has them, as sure as it is of them.
  void take_window_estimates();
  /// Every outline, and the index of planes by place, from what the keyframes saw, where they are
  /// now.
  void remake_outlines();
  /// Takes a keyframe out: its frames and floor hang on another from here on.
  void replace_keyframe(KeyframeId gone, KeyframeId into, const SE3& T_into_gone);
  /// Everything in another map frame, as one body.
  void move(const SE3& T_new_map);
};

/// The plane that has the evidence of `id` now; kNone where there is none.
PlaneId successor_of(const Graph& graph, PlaneId id);

}  // namespace lamina
