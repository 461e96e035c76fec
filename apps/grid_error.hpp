// A navigability grid against the true one.
#pragma once

#include <vector>

#include <lamina/grid/navigability_grid.hpp>

namespace lamina::apps {

/// A cell is called free when its navigability is at least `kFree`.
struct GridErrors {
  static constexpr float kFree = 0.5f;
  std::int64_t compared = 0;  ///< cells known in both
  std::int64_t true_free = 0, true_blocked = 0;
  std::int64_t false_free = 0;                                   ///< called free, truly not
  std::int64_t false_blocked = 0;                                ///< called blocked, truly free
  double false_free_share = 0;                                   ///< of the cells called free
  double false_blocked_share = 0;                                ///< of the cells truly free
  double height_rms_m = 0, height_bias_m = 0, height_max_m = 0;  ///< where both call it free
  std::vector<CellIndex> false_free_cells;                       ///< at most 1000, for pictures
};

/// Both grids in one frame and of one resolution (the nearest cell of `truth` is taken otherwise).
GridErrors grid_errors(const NavigabilityGrid& grid, const NavigabilityGrid& truth);

}  // namespace lamina::apps
