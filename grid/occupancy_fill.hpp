// Navigability where only a 2D scanner has looked.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include <lamina/grid/navigability_grid.hpp>
#include <lamina/grid/occupancy_grid.hpp>

namespace lamina {

struct OccupancyFill {
  double occupied = 0.65;    ///< probability above which a cell is blocked, as map_server has it
  double free = 0.196;       ///< and below which it is free
  double floor_trust = 0.5;  ///< how often what is clear at the scanner's height is floor: nothing
                             ///< looked at steps, holes and what is lower
  double near = 0.1;         ///< m: edges are known to this, as RasterOptions has it
};

/// For maps in which no floor was seen at all (Rasterizer::floor_seen() is false): unknown cells of
/// `grid` that the scanner saw free get navigability 1 and confidence (1 - p) floor_trust, those it
/// saw occupied 0 and p. Height and slope stay unknown. Known cells are left as they are. Both
/// grids must have one resolution. Where floor was seen anywhere this is not for use: there, not
/// seen means not known.
void fill_from_occupancy(NavigabilityGrid& grid, const OccupancyGrid& occupancy,
                         const OccupancyFill& options = {});

/// What scans made of images mark is what stands more than a step over the floor they fitted: ramps
/// further up, swells and noise, far away by decimetres, too. `grid` knows better, as drawn from
/// the same images: cells that it calls free are free, and cells where it has nothing that stands,
/// there or within `near` (m), are not occupied, unless a scanner found something (`scanners`;
/// nullptr: there is none). Both must have one resolution.
void agree_with_ground(OccupancyGrid& occupancy, const OccupancyGrid* scanners,
                       const NavigabilityGrid& grid, const OccupancyFill& options = {});

/// Map z (m) of the ground under a point of the map.
using GroundBelow = std::function<double(const Eigen::Vector3d&)>;

/// Loose points without those at the scanner's height (from `low` to `high`, m, over `ground`, map
/// z of what is under a point; NaN: nobody knows, the point stays; empty: 0) in cells that the
/// scanner saw free: more rays went through than ended there. A beam that grazes the jamb of a door
/// returns from somewhere behind it; a few such returns must not close the door.
std::vector<Eigen::Vector3d> without_passed(const std::vector<Eigen::Vector3d>& points_map,
                                            const OccupancyGrid& occupancy, double low, double high,
                                            const OccupancyFill& options = {},
                                            const GroundBelow& ground = {});

}  // namespace lamina
