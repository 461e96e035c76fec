// Whether a place is told from others around it by surfaces of few directions.
#pragma once

#include <vector>

#include <lamina/frontend/motion/likelihood_grid.hpp>
#include <lamina/frontend/motion/scan_points.hpp>
#include <lamina/frontend/motion/submap.hpp>

namespace lamina {

/// Along a corridor its walls fit at every place, and most points are theirs. So points are parted
/// by the direction of their surface, against map points of that direction: across the corridor
/// (pillars, frames of doors), however few, they count as much as along it. [Rusinkiewicz2001]
/// samples directions evenly for the same reason.
///
/// True when elsewhere in `window`, further from `window.exclude` (where the points fit) than it
/// says, they fit by at least `ratio` of what they do there: less, by the share of them that the
/// map's scans (`fans`) show, where a place lies partly beyond what those saw. And when there is
/// too little across to tell, or the window's turns are too wide (0.3 rad) to tell directions
/// apart.
bool look_alike_elsewhere(const std::vector<OrientedPoint>& map, const std::vector<SightFan>& fans,
                          const std::vector<OrientedPoint>& points, const PlanarPose& start,
                          const SearchWindow& window, double ratio);

}  // namespace lamina
