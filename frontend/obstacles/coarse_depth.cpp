// The least depth of every square.
#include <lamina/frontend/obstacles/coarse_depth.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <lamina/sensors/usable_camera.hpp>

namespace lamina {
namespace {

constexpr int kAcross = 40;
constexpr int kMostMissing = 10;  // one in so many

}  // namespace

DepthLook depth_look(const DepthFrame& frame) {
  DepthLook look;
  const CameraModel& camera = frame.camera.camera;
  const int w = frame.width(), h = frame.height();
  const int side = std::max(1, (std::max(w, h) + kAcross - 1) / kAcross);
  const auto pixels =
      static_cast<std::size_t>(std::max(w, 0)) * static_cast<std::size_t>(std::max(h, 0));
  if (w < side || h < side || frame.raw.size() < pixels) return look;
  if (!usable(camera) || !(frame.camera.depth_scale > 0)) return look;
  look.fx = static_cast<float>(camera.fx / side);
  look.fy = static_cast<float>(camera.fy / side);
  look.cx = static_cast<float>((camera.cx + 0.5) / side);
  look.cy = static_cast<float>((camera.cy + 0.5) / side);
  look.pixel = static_cast<float>(1 / std::min(camera.fx, camera.fy));
  look.noise = static_cast<float>(frame.camera.noise.sigma_depth(1));
  look.nx = w / side;
  look.ny = h / side;
  look.reach.resize(static_cast<std::size_t>(look.nx) * static_cast<std::size_t>(look.ny));
  constexpr double kSaturated = 65535;
  const double scale = frame.camera.depth_scale;
  const double low = std::max(1.0, frame.camera.noise.min_range * scale),
               high = std::min(kSaturated - 1, frame.camera.noise.max_range * scale);
  if (!(low <= high)) return {};
  const auto least = static_cast<std::uint16_t>(std::ceil(low)),
             most = static_cast<std::uint16_t>(high);
  std::vector<int> missing(static_cast<std::size_t>(look.nx));
  std::vector<std::uint16_t> nearest(missing.size());
  for (int j = 0; j < look.ny; ++j) {
    std::fill(missing.begin(), missing.end(), 0);
    std::fill(nearest.begin(), nearest.end(), std::numeric_limits<std::uint16_t>::max());
    for (int v = j * side; v < (j + 1) * side; ++v) {
      const std::uint16_t* row =
          frame.raw.data() + static_cast<std::size_t>(v) * static_cast<std::size_t>(w);
      for (std::size_t i = 0; i < missing.size(); ++i) {
        for (int k = 0; k < side; ++k) {
          const std::uint16_t raw = *row++;
          const bool valid = raw >= least && raw <= most;
          missing[i] += !valid;
          if (valid) nearest[i] = std::min(nearest[i], raw);
        }
      }
    }
    for (std::size_t i = 0; i < missing.size(); ++i) {
      const bool known = missing[i] * kMostMissing <= side * side && missing[i] < side * side;
      look.reach[static_cast<std::size_t>(j) * missing.size() + i] =
          known ? DepthLook::code(nearest[i] / scale) : std::uint8_t{0};
    }
  }
  return look;
}

}  // namespace lamina
