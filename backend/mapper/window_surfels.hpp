// Surfels of floors that are no planes in the sliding window.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>

#include <lamina/backend/mapper/working_map.hpp>

namespace lamina {

/// Which cell of the map is which surfel of the window, and what the present keyframe saw of each.
class WindowSurfels {
 public:
  /// Small pieces of floor that the present keyframe saw (its body frame, weights 1/sigma^2): those
  /// on a rough floor of the window become evidence of its surfels, new ones where there are none.
  /// All of a keyframe together weigh no more than JointSurfelOptions::view_sigma_m allows.
  void add(WorkingMap& map, std::span<const Moments> patches_body);
  /// Cells are made anew from here on: the map has moved.
  void forget();

 private:
  using Cell = std::pair<std::int32_t, std::int32_t>;
  SurfelId surfel_at(WorkingMap& map, const Cell& cell, const PlaneLandmark& parent);

  std::map<Cell, SurfelId> surfels_;
  std::map<SurfelId, Moments> seen_;  // by the present keyframe
  KeyframeId keyframe_ = KeyframeId::kNone;
  std::int64_t next_ = 0;
};

}  // namespace lamina
