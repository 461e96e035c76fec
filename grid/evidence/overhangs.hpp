// Floor behind the rims of table tops and boards: was the space above it ever looked through?
#pragma once

#include <functional>
#include <vector>

#include <lamina/grid/evidence/looks.hpp>
#include <lamina/grid/rasterizer.hpp>
#include <lamina/models/planar_map.hpp>
#include <lamina/models/spool.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {

using ForEachScan = std::function<void(const std::function<void(const KeptScan&)>&)>;

/// Boards seen from little above or below return nothing: their rims show, and the floor below.
/// `solid`: of the grid of `resolution` m. What hangs more than 0.1 m above the floor, no higher
/// than 0.25 m and over 0.2 m or more, is such a rim. `looks` (archived SeenDepth, laid by
/// `trajectory`) that met it, or images' scans that end at it, cast its shadow where looks from
/// there met floor behind it: cells straight behind it, as seen by them, up to 1 m, or to the next
/// rim, or to what stands there. Of each line those are returned that lie before the first that
/// three looks went past at the rim's middle height, or that the robot passed.
std::vector<CellIndex> hidden_behind(const std::vector<SolidCell>& solid, const Spool& looks,
                                     const Trajectory& trajectory, double resolution,
                                     const ForEachScan& for_each_scan = {});
/// Those of the cells that are called free are unknown; heights stay.
void hide(NavigabilityGrid& grid, const std::vector<CellIndex>& cells);

}  // namespace lamina
