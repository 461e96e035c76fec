// Depth images to scans of positive and negative obstacles, without a map.
#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>

#include <lamina/frontend/frontend_options.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

struct ObstacleScanCounts {
  std::int64_t frames = 0, lidar_scans = 0, without_floor = 0, negative_beams = 0;
  bool whole = true;  ///< false: ended early
};

/// Writes a scan for each depth image or stereo pair and each lidar scan, all in the body frame at
/// the last image (docs/formats.md, scans.csv), and cause and sigma of each beam. `ended` is asked
/// after each image.
ObstacleScanCounts write_obstacle_scans(Recording& recording, const FrontEndOptions& options,
                                        const std::function<bool()>& ended, std::ostream& scans,
                                        std::ostream& causes);

}  // namespace lamina
