// The median roughness of many scans, or of the last few where those are calmer, against the
// stated.
#include <lamina/frontend/segments/range_noise.hpp>
#include <lamina/models/median.hpp>

#include <algorithm>

namespace lamina {
namespace {
// A scanner's noise hardly changes, what it sees does: the median is steady over many scans.
constexpr std::size_t kScans = 500;
// What these last ones say counts where they scatter by clearly less than the many.
constexpr std::size_t kLast = 50;
// Up to here the stated noise does: rounded ranges and rough walls make a real scanner's scans as
// rough.
constexpr double kClearly = 1.5;
// Times the stated noise, and m: beyond, it is the surroundings.
constexpr double kMost = 10, kMostSigma = 0.05;
// A scanner said to be noisier than is usual (0.1 m is what loggers write for any) is as good as
// its scans show, and no better than usual.
constexpr double kLess = 3;

}  // namespace

double RangeNoise::update(const LaserScan& scan) {
  const double stated = scan.lidar.noise.range_sigma;
  points_.load(scan, {});
  if (const auto roughness = points_.roughness()) {
    const double observed = *roughness * points_.stated_sigma_r();
    if (observed_.size() < kScans) {
      observed_.push_back(observed);
    } else {
      observed_[static_cast<std::size_t>(next_)] = observed;
      next_ = (next_ + 1) % static_cast<std::int64_t>(kScans);
    }
  }
  stated_ = sigma_ = stated;
  if (observed_.empty()) return sigma_;
  double observed = median(observed_);
  if (const double last = median(last_observed()); last * kClearly < observed) observed = last;
  const double usual = LidarNoise().range_sigma;
  if (observed > kClearly * stated)
    sigma_ = std::min(observed, std::max(kMost * stated, kMostSigma));
  if (kLess * observed < stated && stated > usual) sigma_ = std::max(observed, usual);
  return sigma_;
}

std::vector<double> RangeNoise::last_observed() const {
  const std::size_t size = observed_.size();
  const std::size_t count = std::min(kLast, size);
  const std::size_t end = static_cast<std::size_t>(next_) + size;
  std::vector<double> last;
  last.reserve(count);
  for (std::size_t k = end - count; k < end; ++k) last.push_back(observed_[k % size]);
  return last;
}

}  // namespace lamina
