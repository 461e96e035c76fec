// A rectified stereo pair.
#pragma once

#include <cstdint>
#include <vector>

#include <lamina/models/timestamp.hpp>
#include <lamina/sensors/calibration.hpp>
#include <lamina/sensors/depth_frame.hpp>

namespace lamina {

/// 8-bit grey images, row-major, of the camera's size.
struct StereoFrame {
  Timestamp stamp;
  StereoCamera camera;
  std::vector<std::uint8_t> left, right;
};

/// Semi-global matching with a left-right check, then depth Z = f b / disparity. Disparities up to
/// a sixth of the width are searched. depth_scale is chosen so that 16 bits reach the range where
/// sigma_Z is 5 % of Z (at least 5 m, at most 30 m): steps stay below a millimetre, finer than the
/// noise. Pixels that do not match, or lie further, are 0.
DepthFrame depth_from_stereo(const StereoFrame& pair);

}  // namespace lamina
