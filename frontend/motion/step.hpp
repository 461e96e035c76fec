// What the front-ends say of one instant: the value that goes to the mapper.
#pragma once

#include <cstdint>
#include <optional>

#include <lamina/frontend/motion/observability.hpp>
#include <lamina/frontend/motion/scan_odometry.hpp>
#include <lamina/frontend/motion/wheel_odometry.hpp>
#include <lamina/models/depth_look.hpp>
#include <lamina/models/ground_look.hpp>
#include <lamina/models/observation.hpp>
#include <lamina/sensors/laser_scan.hpp>
#include <lamina/sensors/obstacle_scan.hpp>

namespace lamina {

/// What one instant gave.
struct Step {
  Observations observations;
  Increment motion;          ///< of the body since the step before; identity for the first
  bool motion_known = true;  ///< false: nothing measured it (constant velocity was assumed)
  /// A scan with returns enough that does not fit the last ones wherever it is laid, or a scan or
  /// image that tells no motion (or not surely, after a long gap) where no wheels do: the robot was
  /// carried away, the world changed, or nothing was seen. Its motion is a guess.
  bool tracking_lost = false;
  /// An image, or a scan without wheels, told the motion, but not in all directions.
  bool open_direction = false;
  LeftToWheels left_to_wheels;            ///< where scans or images were asked, too
  bool by_image = false;                  ///< images alone told the motion
  bool slopes = false;                    ///< an image; of late the ground changed its slope
  SE3 T_start_body;                       ///< all motions so far, chained: dead reckoning
  std::optional<LaserScan> scan;          ///< straightened, for loop closing and the occupancy grid
  std::optional<ScanMotion> scan_motion;  ///< since the last scan, of level scanners
  std::optional<SE3> wheels_moved;        ///< the body since the last scan, as wheels have it
  /// Steps just before that lie in a hole of the odometry: this one's motion is what wheels counted
  /// across it.
  std::int64_t across_hole = 0;
  std::optional<ObstacleScan> obstacles;  ///< from depth: levelled frame of this instant
  SE3 T_body_levelled;                    ///< that frame in the body
  std::optional<GroundLook> ground;       ///< from depth, in that frame
  std::optional<DepthLook> sight;         ///< from depth, in the sensor's frame
};

}  // namespace lamina
