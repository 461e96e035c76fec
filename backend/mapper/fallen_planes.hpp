// Walls of scans that lie in the scan, where no beam can meet them, are stood up again.
#pragma once

#include <lamina/backend/mapper/working_map.hpp>

namespace lamina {

/// Lines that contradict each other (a bent wall, a pose that is off) agree best on a plane that
/// lies in the scan: what the present keyframe saw and has fallen that way is stood up and held, in
/// the window alone: the graph's own prior is about upright already. How many.
std::size_t hold_fallen(WorkingMap& map);

/// The same for the graph: lines that contradict each other enough outweigh the prior that a wall
/// of level scans is upright, as one that lies in the scan has no residuals at all. It is stood up
/// along the line that all of them make, and its lean held five times as firmly; its worst lines
/// are outliers then. How many.
std::size_t stand_up_fallen(WorkingMap& map);

}  // namespace lamina
