// Everything between the floor's tolerance and the robot's height, as the least range per beam.
#pragma once

#include <array>
#include <span>
#include <vector>

#include <lamina/frontend/obstacles/floor_walk.hpp>

namespace lamina {

/// Buffers of positive_scan, kept between frames.
struct PositiveBuffers {
  std::vector<float> nearest, x, y, z, before, before2, before3;
  std::array<std::vector<char>, 3> busy;  ///< of three rows: chunks that hold something
};

/// Draws obstacles into `out`. A pixel counts when its height above z = 0 exceeds max_step_m and
/// noise_sigmas of the height's own noise (sigma_Z h / Z, growing with range), and stays below
/// robot_height_m; it must do so in min(3, min_run_px) rows in a row, and the farthest of those is
/// taken, so that single wrong pixels make no obstacle. Pixels of floor planes that a walk entered
/// (ramps, levels within a step) are no obstacles.
void positive_scan(const ScanView& view, std::span<const std::uint8_t> labels,
                   const WalkPlanes& planes, const ScanOptions& options, PositiveBuffers& buffers,
                   ObstacleScan& out, Pace pace = Pace::kStrides);

}  // namespace lamina
