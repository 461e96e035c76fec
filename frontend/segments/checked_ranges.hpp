// Scans with the largest range and the noise that they themselves tell.
#pragma once

#include <algorithm>

#include <lamina/frontend/segments/range_check.hpp>
#include <lamina/frontend/segments/range_noise.hpp>

namespace lamina {

/// Puts right, scan by scan, what a file claims of its scanner's ranges.
class CheckedRanges {
 public:
  LaserScan apply(const LaserScan& measured) {
    LaserScan scan = measured;
    largest_.add(measured);
    scan.range_max = largest_.range_max(measured);
    scan.lidar.noise.range_sigma = noise_.update(scan);
    if (scan.lidar.noise.range_sigma > measured.lidar.noise.range_sigma)
      most_noise_ = std::max(most_noise_, scan.lidar.noise.range_sigma);
    return scan;
  }
  const RangeCheck& largest() const { return largest_; }
  const RangeNoise& noise() const { return noise_; }
  /// m, 1-sigma: how far ranges scattered at most; 0 where no more than stated.
  double most_noise() const { return most_noise_; }

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, CheckedRanges& v) {
    auto& [largest, noise, most_noise] = v;
    a(largest, noise, most_noise);
  }

 private:
  RangeCheck largest_;
  RangeNoise noise_;
  double most_noise_ = 0;
};

}  // namespace lamina
