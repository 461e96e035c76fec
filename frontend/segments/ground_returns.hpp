// What a leaning scanner sees of the ground it drives on.
#pragma once

#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// Takes out (NaN: no return) what may be the ground z = 0 of the body: it moves with the scanner,
/// and scan matching, lines and occupancy take it for walls. A beam from height h (m) that goes
/// down by s a metre meets the ground at h / s; with the mounting in doubt by one part in three,
/// but no more than 1.1 degrees, all from h / (s + doubt) on goes. Left alone are beams that go
/// down by less than 1.1 degrees, scanners said to sit lower than 5 cm (a height nobody stated),
/// and a scan in which a third of these returns lie beyond h / (s - doubt): no ground lets them
/// through, it is the stated lean that is wrong. Returns how many were taken out.
int remove_ground(LaserScan& scan);

}  // namespace lamina
