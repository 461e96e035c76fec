// Sub-sections and their order.
#include <lamina/frontend/depth/sections.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace lamina {

SectionGrid::SectionGrid(const FloorOptions& options)
    : nx_(options.sections[0]),
      ny_(options.sections[1]),
      length_(options.roi_m[0]),
      width_(options.roi_m[1]),
      height_(options.roi_m[2]),
      below_(options.roi_depth_below_m),
      order_(static_cast<std::size_t>(nx_ * ny_)) {
  std::iota(order_.begin(), order_.end(), 0);
  const auto distance = [this](int s) {
    const auto [i, j] = coordinates(s);
    return std::hypot((i + 0.5) * length_ / nx_, (j + 0.5) * width_ / ny_ - 0.5 * width_);
  };
  std::stable_sort(order_.begin(), order_.end(),
                   [&](int a, int b) { return distance(a) < distance(b) - 1e-9; });
}

int SectionGrid::section_of(const Eigen::Vector3d& p) const {
  const double y = p.y() + 0.5 * width_;
  if (!(p.x() >= 0 && p.x() < length_ && y >= 0 && y < width_)) return -1;
  if (!(p.z() >= -below_ && p.z() <= height_)) return -1;
  const int i = std::min(nx_ - 1, static_cast<int>(p.x() / length_ * nx_));
  const int j = std::min(ny_ - 1, static_cast<int>(y / width_ * ny_));
  return i * ny_ + j;
}

}  // namespace lamina
