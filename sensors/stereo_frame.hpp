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

/// Semi-global matching with a left-right check, then depth in units of 0.1 mm ... see
/// stereo_matcher.cpp. Pixels that do not match are 0.
DepthFrame depth_from_stereo(const StereoFrame& pair);

}  // namespace lamina
