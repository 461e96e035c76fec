// From stamps to keyframes.
#include <lamina/pipeline/loop_factors.hpp>

namespace lamina {

namespace {

// Tilt of a body: what is left of its attitude without the heading.
SE3 tilt_of(const SE3& T_map_body) {
  return SE3(SO3::rot_z(-T_map_body.so3().yaw()) * T_map_body.so3(), Eigen::Vector3d::Zero());
}

LoopClosure lifted(LoopClosure loop, const SE3& T_map_from, const SE3& T_map_to) {
  constexpr double kHeight = 0.5, kTilted = 0.1;  // m, rad: what scans do not tell
  const SE3 A_from = tilt_of(T_map_from), A_to = tilt_of(T_map_to);
  Eigen::Vector3d way = loop.T_from_to.translation();
  way.z() += T_map_to.translation().z() - T_map_from.translation().z();
  loop.T_from_to = A_from.inverse() * SE3(loop.T_from_to.so3(), way) * A_to;
  loop.covariance(2, 2) += kHeight * kHeight;
  loop.covariance(3, 3) += kTilted * kTilted;
  loop.covariance(4, 4) += kTilted * kTilted;
  const Matrix6d J = A_to.inverse().adjoint();
  loop.covariance = J * loop.covariance * J.transpose();
  return loop;
}

// The one scanner that loops are measured by; kNone of none or several.
ExtrinsicsId scanner_of(const Graph& graph) {
  ExtrinsicsId only = ExtrinsicsId::kNone;
  for (const Extrinsics& e : graph.extrinsics) {
    if (e.sensor != "lidar") continue;
    if (only != ExtrinsicsId::kNone) return ExtrinsicsId::kNone;
    only = e.id;
  }
  return only;
}

}  // namespace

void LoopBook::note(const Observations& observations, const AddResult& added,
                    const Mapper& mapper) {
  slopes_ = slopes_ || observations.up_body != Eigen::Vector3d::UnitZ();
  const Keyframe* keyframe = mapper.graph().find(added.keyframe);
  if (keyframe == nullptr) return;
  places_[observations.stamp] = {added.keyframe, keyframe->T_map_body.inverse() * added.T_map_body};
}

int LoopBook::transfer(const std::vector<LoopClosure>& loops, Mapper& mapper) const {
  int taken = 0;
  const ExtrinsicsId scanner = scanner_of(mapper.graph());
  const auto pose = [&mapper](const Place& place) {
    const Keyframe* keyframe = mapper.graph().find(place.keyframe);
    return keyframe ? keyframe->T_map_body * place.T_keyframe_body : SE3();
  };
  for (const LoopClosure& flat : loops) {
    const auto from = places_.find(flat.from), to = places_.find(flat.to);
    if (from == places_.end() || to == places_.end()) continue;
    if (from->second.keyframe == to->second.keyframe) continue;
    const LoopClosure loop = slopes_ ? lifted(flat, pose(from->second), pose(to->second)) : flat;
    // T_kf1_kf2 = T_kf1_b1 T_b1_b2 T_b2_kf2; the covariance is in the right tangent of T_b1_b2.
    const SE3 T_body_keyframe = to->second.T_keyframe_body.inverse();
    const Matrix6d J = T_body_keyframe.inverse().adjoint();
    taken += mapper.add_loop(from->second.keyframe, to->second.keyframe,
                             from->second.T_keyframe_body * loop.T_from_to * T_body_keyframe,
                             J * loop.covariance * J.transpose(), scanner);
  }
  return taken;
}

}  // namespace lamina
