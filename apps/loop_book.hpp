// Loops found by matching scans, in the mapper's terms.
#pragma once

#include <map>
#include <vector>

#include <lamina/backend/mapper.hpp>
#include <lamina/frontend/odometry/loop_closer.hpp>

namespace lamina::apps {

/// Remembers which keyframe carries each scan, and hands loops between scans to the mapper as
/// motions between keyframes.
class LoopBook {
 public:
  /// After Mapper::add of the scan at `stamp`.
  void note(Timestamp stamp, const AddResult& added, const Mapper& mapper);
  /// How many of the loops the mapper took: both ends known, and of two keyframes.
  int hand_over(const std::vector<LoopClosure>& loops, Mapper& mapper) const;

 private:
  struct Place {
    KeyframeId keyframe;
    SE3 T_keyframe_body;
  };
  std::map<Timestamp, Place> places_;
};

}  // namespace lamina::apps
