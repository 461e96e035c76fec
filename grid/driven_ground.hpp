// What the robot drove over is floor it can drive, where noise alone leaves that open.
#pragma once

#include <vector>

#include <lamina/grid/rasterizer.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {

struct DrivenOptions {
  double radius = 0.25;  ///< m, of the circle that holds the robot
  double under = 0.1;    ///< m from the path: certainly under the robot
  double floor = 0.05;   ///< m that the path's floor may lie from the body's origin
};

struct DrivenCell {
  CellIndex cell;
  float height = 0;  ///< m, map z: the path's
};

/// Cells of the last update that it leaves unknown, ascending: within `under` of the path whatever
/// the reason; within `radius` where only noise keeps their steps and slopes open. Both where the
/// path lies on a floor that was seen and they are level with it, as far as they were seen. What
/// is blocked stays so.
std::vector<DrivenCell> driven_over(const Rasterizer& rasterizer, const Trajectory& path,
                                    const DrivenOptions& options = {});

/// Makes the cells free: navigability 1, confidence as given, the path's height where none was
/// seen.
void free_cells(NavigabilityGrid& grid, const std::vector<DrivenCell>& cells, double confidence);

}  // namespace lamina
