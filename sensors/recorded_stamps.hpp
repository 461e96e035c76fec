// A path at the stamps that a recording has, whose clocks were corrected to make it.
#pragma once

#include <set>

#include <lamina/models/trajectory.hpp>
#include <lamina/sensors/reclocked_recording.hpp>

namespace lamina {

/// T_map_body where the body was at the uncorrected stamps of scans (`scans`: their corrected ones)
/// and of images (all others of the trajectory): between its poses, and as far as a clock was off
/// beyond its ends, where the motion next to them is carried on.
Trajectory at_recorded_stamps(const Trajectory& trajectory, const ClockOffsets& clocks,
                              const std::set<Timestamp>& scans);

}  // namespace lamina
