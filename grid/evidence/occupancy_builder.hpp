// The occupancy grid of all scans of a run.
#pragma once

#include <limits>
#include <optional>

#include <lamina/grid/evidence/ground_surfaces.hpp>
#include <lamina/grid/evidence/looks.hpp>
#include <lamina/grid/evidence/no_returns.hpp>
#include <lamina/grid/evidence/overhangs.hpp>
#include <lamina/grid/grid_options.hpp>
#include <lamina/grid/occupancy_grid.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {

struct ScanOccupancy {
  std::optional<OccupancyGrid> grid;  ///< empty without scans
  bool of_images = false;             ///< there are scans made of images
  /// Of real scans alone, strays and all; empty without these, or where there are no others.
  std::optional<OccupancyGrid> scanners;
  double seen_through = 0;  ///< OccupancyGrid::seen_through() of real scans, or of images
  double low = std::numeric_limits<double>::infinity();
  double high = -low;  ///< m, heights of scanners above their ground, from low to high
};

/// `ground`: what level planes are under the path; rays of real scans that end on it met nothing.
/// Scans are gone through twice: stray returns of a scanner, whose rays go on behind walls that
/// nearly all others ended at (`OccupancyGrid::solid`), are told by the first grid. Rays made from
/// depth images end at things of any height, and neither tell nor are told so. In the second pass
/// beams of real scans that did not come back clear, too, where options.no_return_is_free has it.
ScanOccupancy occupancy_of_scans(const ForEachScan& for_each_scan, const Trajectory& trajectory,
                                 const GroundHits& ground, const GridOptions& options);

}  // namespace lamina
