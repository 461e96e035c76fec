// Which plane each view of one moment is of.
#pragma once

#include <lamina/backend/mapper/localization.hpp>
#include <lamina/backend/mapper/plane_formation.hpp>

namespace lamina {

/// What one frame or scan shows of planes.
struct FrameViews {
  std::vector<PlaneEvidence> evidence;  ///< body frame; of planes, then of segments
  std::vector<std::int64_t> tracks;     ///< the front-end's, by evidence; -1: none
};

/// Where the body is: beside its keyframe, and in the map.
struct BodyPose {
  BodyInKeyframe relative;
  SE3 T_map_body;
};

struct ViewAssociation {
  std::vector<AssociationDecision> decisions;       ///< by evidence: the plane of the map
  std::vector<std::optional<std::size_t>> forming;  ///< else the forming plane
};

/// Views against the planes near them, one by one within the association's gates, what the
/// front-end followed first; then those that missed a gate together with the others [Neira2001];
/// then planes in the making. `predicted`: the body's pose by odometry.
ViewAssociation associate_views(const WorkingMap& map, const PlaneFormation& formation,
                                const FrameViews& views, const BodyPose& predicted);

}  // namespace lamina
