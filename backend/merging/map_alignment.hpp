// Where one map lies in another: a motion that lays planes of the one upon planes of the other.
#pragma once

#include <string>

#include <lamina/backend/mapper/map_state.hpp>
#include <lamina/backend/merging/free_space.hpp>

namespace lamina {

struct OverlapOptions {
  /// A place is believed where it is this much likelier, by its walls, than that the maps share
  /// nothing, over all places that were looked at, and than every other place.
  double log_odds = 6.9;  ///< a thousand to one
  /// Rays of one map that went through walls of the other, of all wall both have seen: people move
  /// chairs and open doors, but no walls.
  double max_free_share = 0.1;
  /// Planes this near where both were seen may be one; less where their covariances say less.
  double max_angle_deg = 4, max_distance_m = 0.3;
};

/// What was found and what was needed; logarithms of how much likelier.
struct OverlapResult {
  std::optional<MapOverlap> overlap;
  std::string reason;  ///< where nothing was believed: why, with numbers, in one line
  double evidence = 0, needed = 0;
  double lead = 0;          ///< over the next best place; facts that repeat count once
  double wall_m = 0;        ///< seen by both, alike
  double through_m = 0;     ///< of one map, where rays of the other went through
  bool kept_frame = false;  ///< another place fits as well, but this one leaves the frames
};

/// Both maps have z up; turned about z and moved anywhere otherwise. Walls find the place in plan
/// (place_search.hpp), level planes the height and the tilt; without them the height stays. That
/// the recordings began at one mark counts as one place of all that are possible times two: it
/// decides between places that fit alike, and needs little more evidence. Deterministic.
OverlapResult find_overlap(const MapState& a, const MapState& b, const FreeSpace& free_a = {},
                           const FreeSpace& free_b = {}, const OverlapOptions& options = {});

}  // namespace lamina
