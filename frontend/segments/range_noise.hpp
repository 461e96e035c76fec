// How far the ranges of a scanner scatter, as its own scans tell.
#pragma once

#include <cstddef>
#include <vector>

#include <lamina/frontend/segments/scan_returns.hpp>

namespace lamina {

/// What a calibration states of a scanner's noise may be another's. On any line the second
/// difference of inverse ranges is zero (ScanPoints::roughness), so each scan tells its own noise;
/// the median over many scans is robust against clutter, and steady where surroundings change.
class RangeNoise {
 public:
  /// Hears a scan as it was measured and returns range_sigma (m) to be used for it: the stated one,
  /// unless scans scatter by clearly more, or by far less where it is more than usual. Goes back
  /// within some 25 scans of the stated noise.
  double update(const LaserScan& scan);
  /// As returned last; 0 before the first scan. And what that scan stated.
  double sigma() const { return sigma_; }
  double stated() const { return stated_; }
  /// For archives (models/archive.hpp): all that one scan leaves to the next.
  template <class A>
  friend void fields(A& a, RangeNoise& v) {
    a(v.observed_, v.next_, v.sigma_, v.stated_);
  }

 private:
  std::vector<double> last_observed() const;

  ScanPoints points_;             // buffers
  std::vector<double> observed_;  // m, by the last scans
  std::int64_t next_ = 0;         // place of the next one in it, once it is full
  double sigma_ = 0, stated_ = 0;
};

}  // namespace lamina
