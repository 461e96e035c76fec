// Where one map lies in another: a motion that lays planes of the one upon planes of the other.
#pragma once

#include <optional>
#include <string>

#include <lamina/backend/map_state.hpp>

namespace lamina {

struct OverlapOptions {
  double min_area_m2 = 0.3;  ///< planes smaller than this say nothing; lines count as 0.5 m high
  int max_planes = 40;       ///< of each map, the largest: bounds the time
  /// What must agree: planes, and of them walls that fix x and y, or the place is not believed.
  int min_planes = 4;
  double min_shared_m2 = 4;  ///< area that both maps have seen
  /// Pairs agree when their normals differ by less than this and one lies this near to the other
  /// where both were seen: what two runs over the same walls drift apart.
  double max_angle_deg = 4, max_distance_m = 0.15;
  /// The same while the place is still being sought.
  double seek_angle_deg = 8, seek_distance_m = 0.4;
  /// Another place that explains this share of the best one's area makes both unbelieved: rooms
  /// look alike. Unless one leaves the frames where they are up to the drift of two runs (the
  /// odometry of both started at one mark).
  double max_rival_share = 0.85;
  double same_frame_m = 2, same_frame_deg = 10;
};

struct OverlapResult {
  std::optional<MapOverlap> overlap;
  std::string reason;      ///< where nothing was found: why, in a few words
  double shared_m2 = 0;    ///< of the best place
  double rival_share = 0;  ///< of the next best one elsewhere
};

/// Both maps have z up; turned about z and moved anywhere otherwise. Headings of pairs of walls
/// propose turns, pairs of such pairs and pairs of level planes propose shifts; each proposal is
/// solved over all pairs that agree, outline upon outline, and weighed by the area both maps have
/// seen. Believed when it has planes and area enough, fixes all six directions, and no other place
/// explains nearly as much. Deterministic.
OverlapResult find_overlap(const MapState& a, const MapState& b,
                           const OverlapOptions& options = {});

}  // namespace lamina
