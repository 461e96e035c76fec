// What the simulated depth camera sees: a floor that rises a millimetre a frame. A formula, so that
// driver, writers and tests agree without talking to each other. C++17: the bag writer uses it.
#pragma once

#include <cmath>
#include <cstdint>

namespace lamina::test {

struct DepthMode {
  int width = 64, height = 48, fps = 30, frames = 5;
  static constexpr int kLargest = 10000;  // mm

  double focal() const { return 0.9 * width; }  // px
  double horizontal_fov() const { return 2 * std::atan(0.5 * width / focal()); }
  double vertical_fov() const { return 2 * std::atan(0.5 * height / focal()); }
  std::uint64_t stamp_us(int frame) const {
    return static_cast<std::uint64_t>(frame) * 1000000u / static_cast<std::uint64_t>(fps);
  }
};

/// Depth (mm) at a pixel: a camera 1.2 m above the floor, tilted down by 0.35 rad; 0 above the
/// horizon.
inline std::uint16_t simulated_depth_mm(const DepthMode& mode, int u, int v, int frame) {
  const double y = (v - 0.5 * (mode.height - 1)) / mode.focal();
  const double down = std::sin(0.35) + y * std::cos(0.35);
  const double z_mm = (1200.0 - frame) / down + (u % 7);
  return down <= 1e-6 || z_mm >= DepthMode::kLargest
             ? std::uint16_t{0}
             : static_cast<std::uint16_t>(std::lround(z_mm));
}

}  // namespace lamina::test
