// Intrinsics that rays can be made of.
#pragma once

#include <cmath>

#include <lamina/sensors/calibration.hpp>

namespace lamina {

/// Numbers all of them, focal lengths of a lens there can be: else an image shows nothing.
inline bool usable(const CameraModel& camera) {
  constexpr double kShortest = 1e-2, kLongest = 1e7, kFarthest = 1e7;  // px
  const auto focal = [](double f) { return f >= kShortest && f <= kLongest; };
  const auto centre = [](double c) { return std::abs(c) <= kFarthest; };
  return focal(camera.fx) && focal(camera.fy) && centre(camera.cx) && centre(camera.cy) &&
         camera.T_body_camera.matrix().allFinite();
}

}  // namespace lamina
