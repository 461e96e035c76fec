// Options of self-calibration, over those of the front-end that it works with.
#pragma once

#include <lamina/backend/mapper/mapper_options.hpp>
#include <lamina/frontend/frontend_options.hpp>

namespace lamina {

struct CalibrationOptions : FrontEndOptions {
  int threads = 2;
  /// s that stamps are late by: taken off them
  double scanner_delay = 0, camera_delay = 0, odometry_delay = 0;
  bool find_clocks = true;      ///< offline: delays are found by turns
  bool find_sweep = true;       ///< offline: scan durations likewise, where nothing states them
  bool calibrate_depth = true;  ///< offline: planes tell a slow bend of the depth image
  bool images_beside_wheels = true;  ///< offline: depth images tell the motions wheels told, too
  bool calibrate_mountings = true;   ///< offline: what is seen corrects where sensors sit
  double mounting_sigma_heading_deg = 1.5;  ///< how well stated mountings are known
  double mounting_sigma_place_m = 0.03;
  /// Offline: where sensors sit is estimated together with poses and planes, all six numbers each.
  bool refine_extrinsics = false;
  MapperOptions mapper;
};

}  // namespace lamina
