// Loops found by matching scans, in the mapper's terms.
#pragma once

#include <map>
#include <vector>

#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/frontend/loops/loop_closer.hpp>

namespace lamina {

/// Remembers which keyframe carries each scan, and hands loops between scans to the mapper as
/// motions between keyframes. Scans tell loops in the plane of the scanner: of a body that tilts
/// with the ground (Observations::up_body) T_a_b is A_a^-1 (T_a_b + z_b - z_a) A_b, with tilts A
/// and heights z of the map so far, and height and tilt open.
class LoopBook {
 public:
  /// After Mapper::add of a scan.
  void note(const Observations& observations, const AddResult& added, const Mapper& mapper);
  /// How many of the loops the mapper took: both ends known, and of two keyframes.
  int transfer(const std::vector<LoopClosure>& loops, Mapper& mapper) const;

 private:
  struct Place {
    KeyframeId keyframe;
    SE3 T_keyframe_body;
  };
  std::map<Timestamp, Place> places_;
  bool slopes_ = false;
};

}  // namespace lamina
