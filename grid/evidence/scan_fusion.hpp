// One scan in the body frame of what depth and a real 2D lidar see.
#pragma once

#include <optional>

#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// Keeps the last scan of each kind; every new one is joined with the last of the other, moved by
/// the robot's motion in between, while that is no older than `kMaxAge`. A robot with one sensor
/// gets its scans alone. Beams lie in the body frame, angle 0 ahead.
class CombinedScan {
 public:
  static constexpr double kMaxAge = 0.6;  ///< s: one frame of a camera at 2 Hz, and a little

  enum class Kind { kLidar, kDepth };
  /// `scan` in its own frame, `scan.lidar.T_body_lidar` says where that is; `T_start_body`: where
  /// the body was, in any frame that does not move.
  LaserScan add(const LaserScan& scan, Kind kind, const SE3& T_start_body);

 private:
  struct Seen {
    LaserScan scan;
    SE3 T_start_body;
  };
  static LaserScan in_body(const Seen& seen, const std::optional<Seen>& other);
  std::optional<Seen> lidar_, depth_;
};

}  // namespace lamina
