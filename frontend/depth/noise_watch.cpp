// Counting, and the middle of the counts.
#include <lamina/frontend/depth/noise_watch.hpp>
#include <lamina/models/median.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace lamina {

void NoiseWatch::add(double scale) {
  if (!(scale > 0)) return;
  const double last = static_cast<double>(counts_.size()) - 1;
  const double k = std::clamp(std::floor(std::log(scale) / kStep), 0.0, last);
  ++counts_[static_cast<std::size_t>(k)];
  ++images_;
}

double NoiseWatch::median() const {
  if (images_ == 0) return 1;
  std::int64_t below = 0;
  std::size_t k = 0;
  while (k + 1 < counts_.size() && 2 * (below + counts_[k]) < images_) below += counts_[k++];
  return std::exp(kStep * static_cast<double>(k));
}

double raised_by_rounding(const DepthFrame& frame) {
  constexpr std::size_t kStep = 61;  // pixels: no divisor of usual widths
  std::vector<std::uint16_t> depths;
  for (std::size_t i = 0; i < frame.raw.size(); i += kStep) {
    if (frame.raw[i] > 0) depths.push_back(frame.raw[i]);
  }
  if (depths.empty()) return 1;
  const double unit = 1 / frame.camera.depth_scale;
  const double sigma = frame.camera.noise.sigma_depth(lamina::median(depths) * unit);
  return sigma > 0 ? std::hypot(1, unit / (std::sqrt(12) * sigma)) : 1;
}

}  // namespace lamina
