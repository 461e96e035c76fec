// Writes the simulated recording as a ROS 1 bag. C++17, no ROS types.
#pragma once

#include <string>

namespace lamina::test {

/// Depth as 16UC1 (or 32FC1) with CameraInfo, a scan and an odometry message at every depth stamp
/// (plus one second: ROS has no time zero), and a static transform base_link -> laser at (0.2, 0,
/// 0.3). With `transforms_only` the odometry is a transform odom -> chassis, and the laser sits on
/// chassis: neither has a name that readers know.
void write_simulated_bag(const std::string& file, bool floats, bool transforms_only = false);

}  // namespace lamina::test
