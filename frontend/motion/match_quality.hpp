// How well scans or images usually fit what came before: after a gap in time, the only witness.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <lamina/models/content_hash.hpp>
#include <lamina/models/timestamp.hpp>

namespace lamina {

/// Running mean and mean deviation of the fit (fraction matched, 0 to 1) while tracking, and when
/// that was last. Nothing says how a robot moved while nothing was measured: from
/// 1/2 a t^2 = 2 m on (a = 1 m/s^2, so t = 2 s) it may have left the reach of every search, and a
/// match that is worse than usual may be that of another place that looks alike. A sensor that
/// repeats itself measures nothing either.
class UsualFit {
 public:
  static constexpr double kLongGap = 2;  ///< s

  /// True when these are the very numbers of the call before: no two measurements are, so the
  /// sensor is frozen and tells nothing of the motion (or it is without noise, and stands still).
  template <class T>
  bool repeated(const std::vector<T>& values) {
    const std::uint64_t sum = content_hash(values);
    const bool same = sum_ == sum;
    sum_ = sum;
    return same;
  }
  /// A frame that was tracked.
  void tracked(Timestamp stamp, double fit) {
    constexpr double kMemory = 0.1;  // share of the newest: some ten frames
    if (!mean_) mean_ = fit;
    deviation_ += kMemory * (std::abs(fit - *mean_) - deviation_);
    *mean_ += kMemory * (fit - *mean_);
    last_ = stamp;
  }
  /// A frame that others will be matched with, itself matched with none.
  void began(Timestamp stamp) { last_ = stamp; }
  /// True when nothing was tracked for long before `stamp`.
  bool gap_before(Timestamp stamp) const { return last_ && stamp - *last_ > kLongGap; }
  /// True for a fit worse than usual by more than it varies (three mean deviations, at least 0.05).
  bool worse(double fit) const {
    constexpr double kLeast = 0.05, kDeviations = 3;
    return mean_ && fit < *mean_ - std::max(kLeast, kDeviations * deviation_);
  }

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, UsualFit& v) {
    a(v.mean_, v.deviation_, v.last_, v.sum_);
  }

 private:
  std::optional<double> mean_;
  double deviation_ = 0;
  std::optional<Timestamp> last_;
  std::optional<std::uint64_t> sum_;
};

}  // namespace lamina
