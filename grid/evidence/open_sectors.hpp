// Which empty beams of a scan look out into the open.
#pragma once

#include <vector>

#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// By beam: whether it came back empty amid walls that leave the scanner's range by themselves, on
/// both sides: the last return beside the gap comes from range_max (its last tenth), or the next
/// would by the step of the one before. What ends nearer may go on black, or as glass.
std::vector<char> open_sectors(const LaserScan& scan);

}  // namespace lamina
