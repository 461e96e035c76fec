// The median roughness of the last scans against what is stated.
#include <lamina/frontend/segments/range_noise.hpp>

#include <algorithm>

namespace lamina {
namespace {
constexpr std::size_t kScans = 50;
// Up to here the stated noise does: rounded ranges and rough walls make a real scanner's scans as
// rough.
constexpr double kClearly = 1.5;
constexpr double kMost = 10;  // times the stated noise: beyond, it is the surroundings
}  // namespace

double RangeNoise::hear(const LaserScan& scan) {
  const double stated = scan.lidar.noise.range_sigma;
  points_.load(scan, {});
  if (const auto roughness = points_.roughness()) {
    const double told = *roughness * points_.stated_sigma_r();
    if (told_.size() < kScans) {
      told_.push_back(told);
    } else {
      told_[static_cast<std::size_t>(next_)] = told;
      next_ = (next_ + 1) % static_cast<std::int64_t>(kScans);
    }
  }
  sigma_ = stated;
  if (told_.empty()) return sigma_;
  std::vector<double> sorted = told_;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  if (*middle > kClearly * stated) sigma_ = std::min(*middle, kMost * stated);
  return sigma_;
}

}  // namespace lamina
