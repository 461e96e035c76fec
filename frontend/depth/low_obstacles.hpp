// Is this patch of ground raised or sunk? A test of means against their standard errors.
#pragma once

#include <cstdint>
#include <vector>

#include <lamina/frontend/depth/floor_options.hpp>
#include <lamina/frontend/depth/floor_result.hpp>

namespace lamina {

/// Evidence of one ground cell: mean height above the floor's plane, its independent variance and
/// the variance of what neighbouring cells share.
struct CellEvidence {
  float height = 0;           ///< m above the plane of reference
  float information = 0;      ///< 1/m^2 of independent noise; 0: unseen
  float shared_variance = 0;  ///< m^2
  float range = 0;            ///< m, to the sensor: bands of the empirical null
};

struct EvidenceGrid {
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();
  double cell_m = 0.05;
  int nx = 0, ny = 0;
  std::vector<CellEvidence> cells;  ///< (i, j) at i * ny + j
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(j);
  }
};

/// The floor as its surroundings have it: medians at nodes `step` cells apart, bilinear between.
struct LocalFloor {
  struct Node {
    float height = 0;
    bool known = false;
  };
  int rows = 0, step = 1;   ///< nodes along j; cells between nodes
  std::vector<Node> nodes;  ///< (a, b) at a * rows + b
  /// m above the plane of reference at cell (i, j), seen or not; 0 where no node around is known.
  float at(int i, int j) const;
};

/// Two-sided normal threshold: P(|z| > result) = probability.
double normal_threshold(double probability);

/// Steps, each over the whole grid:
/// 1. the local floor: medians over windows of local_floor_m, interpolated; taken off the heights;
/// 2. means over 3 x 3 cells and their standard error, independent and shared part;
/// 3. the empirical null [Efron2004]: where the floor's own scores spread wider than 1 (by their
///    median absolute deviation, in bands of range), standard errors grow by that much;
/// 4. cells beyond the threshold at which a whole grid of flat floor shows a false one with
///    probability `false_alarm`, connected (8 neighbours), of one sign, at least
///    min_obstacle_cells and min_obstacle_height_m.
/// `residuals` (if given) gets the heights above the local floor, NaN where unseen; `local_floor`
/// that floor itself.
std::vector<LowObstacle> find_low_obstacles(const EvidenceGrid& grid, const FloorOptions& options,
                                            std::vector<float>* residuals = nullptr,
                                            LocalFloor* local_floor = nullptr);

}  // namespace lamina
