// Do left and right images belong together?
#pragma once

#include <optional>
#include <vector>

#include <lamina/frontend/depth/floor_options.hpp>
#include <lamina/sensors/camera_corrected_recording.hpp>

namespace lamina {

/// A pair and the wheels' pose then.
struct PairView {
  StereoFrame pair;
  std::optional<SE3> T_odom_body;
};

/// What pairs, in a row, say of each other.
struct StereoFindings {
  std::size_t asked = 0;    ///< pairs whose matches were counted
  double matched = 0;       ///< share of their pixels whose like was found, as they are
  std::size_t swapped = 0;  ///< of them, pairs that match only with left and right swapped
  bool all_swapped() const { return swapped > 0 && 4 * swapped > 3 * asked; }
  /// Pairs by which right images are late (below 0: left ones): floors in turns lie as stated then,
  /// and not as they are. 0: none, or nobody can say.
  int right_late = 0;
  std::size_t turns = 0;         ///< pairs in turns
  std::size_t floors = 0;        ///< of these, floors as stated, as pairs are
  std::size_t floors_later = 0;  ///< likewise, by other pairs
  bool turns_misfit = false;     ///< floors lie as stated straight on but not in turns
};

/// Of some pairs how they match, of those in turns whose images belong together.
StereoFindings check_pairs(const std::vector<PairView>& pairs, const FloorOptions& options);

}  // namespace lamina
