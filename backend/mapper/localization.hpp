// Where the body is beside its keyframe: carried on by odometry, corrected by planes held still.
#pragma once

#include <span>

#include <lamina/backend/mapper/working_map.hpp>

namespace lamina {

/// The body relative to its keyframe.
struct BodyInKeyframe {
  SE3 T_keyframe_body;
  Matrix6d covariance = Matrix6d::Zero();  ///< in the right tangent (translation, rotation)

  /// By a motion of the body and its covariance, in its own right tangent.
  void advance(const SE3& T_prev_body, const Matrix6d& covariance_increment);
};

/// The body's pose relative to the present keyframe, planes held: prior from the prediction, planes
/// as seen. `evidence` is in the body frame, `decisions` says of which plane each is. As predicted
/// where it cannot be solved.
BodyInKeyframe localized(const WorkingMap& map, std::span<const PlaneEvidence> evidence,
                         std::span<const AssociationDecision> decisions,
                         const BodyInKeyframe& predicted);

}  // namespace lamina
