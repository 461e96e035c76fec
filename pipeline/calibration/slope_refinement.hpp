// Slopes a robot with a level scanner drove over: what scans take for level, told by depth images.
#pragma once

#include <functional>
#include <vector>

#include <lamina/frontend/frontend.hpp>
#include <lamina/pipeline/calibration/motion_refinement.hpp>

namespace lamina {

struct SlopesByImages {
  int observed = 0;                ///< images that told height and tilt; 0 where the way is level
  double most_tilt = 0;            ///< rad, of the body against its first pose
  double lowest = 0, highest = 0;  ///< m, likewise
};

/// Scans and wheels tell the motion in the body's own plane: x, y and heading. A second look over
/// the depth images tells the rest of it, height, roll and pitch, by depth odometry about the
/// motion that is known. Where the body's tilt changes within a few metres by more than a floor's
/// unevenness, motions are lifted off the plane, T_i-1_i exp(0, 0, dz, droll, dpitch, 0), shared
/// among the steps from image to image by way, and scans are told where up is
/// (Observations::up_body). Everything stays as it was where the way is level. `ended` returning
/// true stops early, and leaves all as it was.
SlopesByImages follow_slopes(const OpenRecording& open, const DepthDistortion& distortion,
                             std::vector<Step>& steps, const std::function<bool()>& ended);

}  // namespace lamina
