// The methods of the document on negative obstacles as written: a fixed tolerance, no contiguity,
// no noise model.
#pragma once

#include <lamina/frontend/obstacles/scan_view.hpp>
#include <lamina/sensors/obstacle_scan.hpp>

namespace lamina {

/// Least range per beam of points between `tolerance` and `robot_height` (m, body z).
void document_positive_scan(const ScanView& view, double tolerance, double robot_height,
                            ObstacleScan& out);
/// Farthest range per beam of points within `tolerance` of the floor (|z|, m; feet of walls
/// included). Cause: ledge. It fails wherever floor lies beyond a hole.
void document_farthest_point(const ScanView& view, double tolerance, ObstacleScan& out);
/// Points below -tolerance (m, body z) projected along their ray onto z = 0: with the optical
/// centre c at height h and y its depth below the camera, p' = c + (p - c) h / y; least range per
/// beam. Cause: hole.
void document_virtual_floor(const ScanView& view, double tolerance, ObstacleScan& out);

}  // namespace lamina
