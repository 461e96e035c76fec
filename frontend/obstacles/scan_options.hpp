// Settings of the obstacle scans: one struct, every member with unit, default and reason.
#pragma once

#include <string>
#include <vector>

namespace lamina {

/// How negative obstacles are found.
enum class NegativeMethod {
  kContiguousFloor,  ///< ours: walk outward over the fitted floor, with virtual floor projection
  kDocument,  ///< the two methods of the document on negative obstacles as written, for comparison
};

struct ScanOptions {
  NegativeMethod method = NegativeMethod::kContiguousFloor;
  /// false: the mounting as calibrated instead of this frame's levelled one (to show what that
  /// costs: 1 deg of error makes holes of flat floor).
  bool leveled = true;

  // Beams, in the body frame about z.
  double angle_increment_deg = 0;  ///< deg; 0: what one pixel in the middle of the image spans
  double range_max_m = 0;          ///< m; 0: the range of the camera's noise model

  // The robot.
  double robot_height_m = 0.75;    ///< m: what is higher is no obstacle
  double max_step_m = 0.02;        ///< m: higher steps stop the robot
  double max_slope_deg = 20;       ///< deg: planes up to here are floor, rising or falling
  double min_hole_depth_m = 0.02;  ///< m: shallower is no hole to any wheel
  double min_level_area_m2 = 0.5;  ///< m^2 from which a level or ramp is a floor of its own

  /// false: a beam ends where knowledge of the ground ends, whatever stands behind (never free).
  /// true: the obstacle behind unseen ground is kept, for mapping walls with low cameras.
  bool obstacles_beyond_knowledge = false;

  // Evidence.
  double noise_sigmas = 5;       ///< sigmas of one pixel beyond which it lies off the floor
  int min_run_px = 3;            ///< pixels in a row that must agree before floor ends or goes on
  double max_gap_m = 0.10;       ///< m of unseen ground that is bridged when floor goes on behind
  double max_faded_gap_m = 0.3;  ///< the same where the sensor loses the floor by grazing incidence
  double grazing_deg = 78;       ///< deg of incidence beyond which sensors lose a floor unaided
  double lost_deg = 81.7;        ///< deg of incidence beyond which no sensor sees a floor
  double local_floor_m = 0.4;    ///< m walked over which the floor's own unevenness is followed
  double document_tolerance_m = 0.03;  ///< m: the document's fixed tolerance about the floor

  /// All that is wrong with the settings, one line each; empty when they can be used.
  std::vector<std::string> problems() const;
};

}  // namespace lamina
