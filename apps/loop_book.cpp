// From stamps to keyframes.
#include <lamina/apps/loop_book.hpp>

namespace lamina::apps {

void LoopBook::note(Timestamp stamp, const AddResult& added, const Mapper& mapper) {
  const Keyframe* keyframe = mapper.graph().find(added.keyframe);
  if (keyframe == nullptr) return;
  places_[stamp] = {added.keyframe, keyframe->T_map_body.inverse() * added.T_map_body};
}

int LoopBook::hand_over(const std::vector<LoopClosure>& loops, Mapper& mapper) const {
  int taken = 0;
  for (const LoopClosure& loop : loops) {
    const auto from = places_.find(loop.from), to = places_.find(loop.to);
    if (from == places_.end() || to == places_.end()) continue;
    if (from->second.keyframe == to->second.keyframe) continue;
    // T_kf1_kf2 = T_kf1_b1 T_b1_b2 T_b2_kf2; the covariance is in the right tangent of T_b1_b2.
    const SE3 T_body_keyframe = to->second.T_keyframe_body.inverse();
    const Matrix6d J = T_body_keyframe.inverse().adjoint();
    taken += mapper.add_loop(from->second.keyframe, to->second.keyframe,
                             from->second.T_keyframe_body * loop.T_from_to * T_body_keyframe,
                             J * loop.covariance * J.transpose());
  }
  return taken;
}

}  // namespace lamina::apps
