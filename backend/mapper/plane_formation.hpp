// Planes before they enter the map: views gather until there are enough of them.
#pragma once

#include <lamina/backend/mapper/working_map.hpp>

namespace lamina {

/// A plane that has not shown itself often enough yet.
struct FormingPlane {
  PlaneLandmark landmark;
  double tilt_sigma = 0;                      ///< rad, of the prior on its tilt
  std::set<std::int64_t> tracks;              ///< of the front-end
  std::map<KeyframeId, PlaneViews> evidence;  ///< in each keyframe's body frame
  KeyframeId last = KeyframeId::kNone;
};

/// Planes in the making, and which plane each track of the front-end is of. Forming planes are
/// named by their index, until forget().
class PlaneFormation {
 public:
  /// What is known of each forming plane, by index: nothing of the keyframe's pose.
  std::vector<AssociationCandidate> candidates() const;
  /// The forming plane that evidence (body frame) is of. `young`: candidates(), their covariances
  /// with the body's pose.
  std::optional<std::size_t> match(const WorkingMap& map, const PlaneEvidence& evidence,
                                   std::int64_t track, const SE3& T_map_body,
                                   const std::vector<AssociationCandidate>& young) const;
  /// The plane of the map that a track is of (below 0: no track).
  std::optional<PlaneId> followed(const Graph& graph, std::int64_t track) const;
  /// A track was seen to be of a plane at keyframe `now`.
  void link(std::int64_t track, PlaneId plane, KeyframeId now);

  /// One more view, in the present keyframe's body frame, of forming plane `which`, or of a new
  /// one.
  void add(const WorkingMap& map, std::optional<std::size_t> which, const PlaneEvidence& evidence,
           std::int64_t track, Timestamp stamp);
  /// Those with evidence enough enter the map, its window and its graph.
  std::vector<PlaneId> promote(WorkingMap& map);
  /// Forming planes that entered the map, and what was not seen for so many keyframes.
  void forget(KeyframeId now, std::int64_t keyframes);
  /// Each anew by its keyframes' poses of now.
  void refit(const WorkingMap& map);

 private:
  struct TrackLink {
    PlaneId plane = PlaneId::kNone;
    KeyframeId last = KeyframeId::kNone;  // when it was seen
  };
  std::optional<PlaneId> promote(WorkingMap& map, FormingPlane& forming);
  std::vector<FormingPlane> forming_;
  std::map<std::int64_t, TrackLink> tracks_;
};

}  // namespace lamina
