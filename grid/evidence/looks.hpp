// What single scans and images said of the ground and of free space, kept for the whole run.
#pragma once

#include <vector>

#include <lamina/models/depth_look.hpp>
#include <lamina/models/ground_look.hpp>
#include <lamina/models/planar_map.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// Rims of holes seen at one instant, and how far floor was seen past them.
struct SeenRims {
  Timestamp stamp;
  SE3 T_body_levelled;
  double angle_min = 0, angle_increment = 0;
  std::vector<float> reach;  ///< m from the origin, ground seen without a break
  std::vector<EdgePoint> rims_levelled;
};

/// What an image saw of the ground, and where that frame lies in the body.
struct SeenGround {
  Timestamp stamp;
  SE3 T_body_levelled;
  GroundLook look;
};

/// What an image saw through, and where its camera is in the body.
struct SeenDepth {
  Timestamp stamp;
  SE3 T_body_camera;
  DepthLook look;
};

/// A scan in its own frame (`scan.lidar.T_body_lidar`), real or made from depth.
struct KeptScan {
  LaserScan scan;
  bool from_depth = false;
};

}  // namespace lamina
