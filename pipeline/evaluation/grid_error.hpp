// A navigability grid against the true one.
#pragma once

#include <vector>

#include <lamina/grid/navigability_grid.hpp>
#include <lamina/models/lie/se3.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {

/// A cell is called free when its navigability is at least `kFree`. "Blocked" is a verdict too:
/// cells that the map calls unknown are neither.
///
/// The map says where an edge lies to `kTolerance` (docs/grid.md). A false free counts wherever the
/// truth blocks the cell. A false blocked counts on flat floor alone: truly free cells further than
/// the tolerance from any place that is truly blocked, and from any change of level or slope.
struct GridErrors {
  static constexpr float kFree = 0.5f;
  static constexpr double kTolerance = 0.1;   ///< m
  static constexpr float kFlatStep = 0.005f;  ///< m between neighbours: more is no flat floor
  std::int64_t compared = 0;                  ///< cells known in both
  std::int64_t called_free = 0, true_free = 0, true_blocked = 0;  ///< of those compared
  std::int64_t false_free = 0;                                    ///< called free, truly not
  std::int64_t false_free_pits = 0;  ///< of these: below the floor around by more than kPit, or
                                     ///< with nothing below: holes, stairs down, ledges
  std::int64_t false_free_deep = 0;  ///< of these: further than a cell from truly free ground
  std::int64_t flat_floor = 0;       ///< compared cells of flat floor, and those called unknown
  std::int64_t unknown_flat = 0;     ///< of these: seen (a height is known), called unknown
  std::int64_t unknown_ends = 0;     ///< of these: beside a cell where nothing was seen
  std::int64_t false_blocked = 0;    ///< of these: called blocked
  std::int64_t blocked_edges = 0;  ///< called blocked, truly free, within the tolerance of an edge
  double false_free_share = 0;     ///< of the cells called free
  double false_blocked_share = 0;  ///< of flat floor
  double unknown_share = 0;        ///< of flat floor
  double height_rms_m = 0, height_bias_m = 0, height_max_m = 0;  ///< where both call it free
  /// Of these, with the map's path within kNearPath of the cell; 0 of them where no path is given.
  double near_height_rms_m = 0;
  std::int64_t near_heights = 0;
  std::vector<CellIndex> false_free_cells;     ///< at most 1000, for pictures
  std::vector<CellIndex> false_blocked_cells;  ///< likewise

  static constexpr float kPit = 0.02f;      ///< m
  static constexpr double kNearPath = 3.0;  ///< m
};

/// `T_truth_map` leads from the map's frame to the truth's: each cell is compared with the true
/// cell its centre falls in. `truth` holds 0 navigability and no height where nothing is below.
/// `path_map`: T_map_body, tells which heights lie near the path.
GridErrors grid_errors(const NavigabilityGrid& grid, const NavigabilityGrid& truth,
                       const SE3& T_truth_map = SE3(), const Trajectory& path_map = {});

/// A planned path on the truth: its places and the middles between them, and how many of those
/// are not truly free.
struct PathErrors {
  std::int64_t places = 0, not_free = 0;
};
PathErrors path_errors(const std::vector<Eigen::Vector2d>& path_map, const NavigabilityGrid& truth,
                       const SE3& T_truth_map = SE3());

}  // namespace lamina
