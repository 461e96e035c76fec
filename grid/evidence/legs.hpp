// Floor between legs that go on above the images: nobody saw what they carry.
#pragma once

#include <vector>

#include <lamina/grid/rasterizer.hpp>
#include <lamina/models/spool.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {

/// `solid`: of the grid of `resolution` m. Legs are thin things that stand on the floor and that no
/// look saw end: none of `looks` (archived SeenDepth, laid by `trajectory`) went past above
/// them, and their seen top is lower than `robot_height` m. Three of them within 1.1 m carry
/// something for all that is known; two, and what hangs no lower than they were seen to reach, too.
/// Cells between such are returned, unless three looks went past at all heights from the lower
/// seen top of the three to the robot's, or the robot passed.
std::vector<CellIndex> between_legs(const std::vector<SolidCell>& solid, const Spool& looks,
                                    const Trajectory& trajectory, double resolution,
                                    double robot_height);

}  // namespace lamina
