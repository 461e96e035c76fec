// The shortest safe path over a grid.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include <lamina/grid/navigability_grid.hpp>

namespace lamina {

struct PlannerOptions {
  double robot_radius = 0.25;  ///< m: no cell within it of the path may be blocked or unknown
  double max_step = 0.02;      ///< m, T: largest step between neighbouring cells
  double comfort = 0.3;        ///< m beyond the radius: further off clearance costs nothing more
  double clear_weight = 2;     ///< a metre as close as the radius allows costs 1 + this many metres
  double level_weight = 1;     ///< a metre on navigability v costs this (1/v - 1) metres more
  /// m: where the start itself was never seen (a camera looks ahead, not under the robot) the path
  /// may begin at the nearest place this far off. Never where the start is known to be blocked.
  double start_reach = 1.0;
  /// One line for each setting that cannot be.
  std::vector<std::string> problems() const;
};

enum class PlanStatus { kFound, kStartNotFree, kGoalNotFree, kNoWay };

struct Plan {
  PlanStatus status = PlanStatus::kNoWay;
  std::vector<Eigen::Vector2d> path_map;  ///< from start to goal, both included; empty: none
  double length = 0;                      ///< m along path_map
  std::string reason;                     ///< one line, empty when found: what is in the way, where
  /// Where it ends: the place reached that lies nearest to the goal. Only with kNoWay.
  std::optional<Eigen::Vector2d> nearest_map;
};

/// A* over TraversabilityGraph [Hart1968] among cells at least the robot's radius clear of all that
/// is blocked or unknown. The cost of an edge is its length times
/// 1 + clear_weight max(0, 1 - (clearance - radius) / comfort) + level_weight (1/v - 1), so that it
/// prefers clear, level floor. Positions in the map frame, m. Memory: some 30 bytes for each cell
/// of the known rectangle.
/// Throws lamina::Error when options.problems() is not empty.
Plan plan_path(const NavigabilityGrid& grid, const Eigen::Vector2d& from_map,
               const Eigen::Vector2d& to_map, const PlannerOptions& options = {});

}  // namespace lamina
