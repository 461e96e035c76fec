// How long one turn of a scanner takes: as its scans say, as set, or found on the way.
#pragma once

#include <algorithm>
#include <optional>
#include <utility>

#include <lamina/frontend/motion/sweep_watch.hpp>

namespace lamina {

class ScanDuration {
 public:
  /// s, of scans that do not say; 0: they are taken as of one instant.
  explicit ScanDuration(double seconds) : seconds_(seconds) {}
  void set(double seconds) { seconds_ = seconds; }
  double seconds() const { return seconds_; }
  /// Looks for it on the way: where no look over the whole recording came before (online).
  void watch() { watch_.emplace(); }

  /// s from the first beam to the last.
  double of(const LaserScan& scan) const {
    const double beams = static_cast<double>(std::max<std::size_t>(scan.size(), 2) - 1);
    return scan.time_increment > 0 ? scan.time_increment * beams : seconds_;
  }
  /// A scan like this may still say something.
  bool watches(const LaserScan& scan) const {
    return watch_ && !watch_->done() && !(scan.time_increment > 0);
  }
  /// A scan as measured and the motion to it (SweepWatch::add). What is found holds from the next
  /// scan on.
  void add(const LaserScan& measured, const std::optional<SE3>& moved, bool finely) {
    if (!watches(measured)) return;
    watch_->add(measured, moved, finely);
    const auto found = watch_->found_on_the_way();
    if (!found) return;
    found_ = found;
    seconds_ = found->sweep;
  }
  /// What was found since the last call.
  std::optional<SweepFinder::Found> take_found() { return std::exchange(found_, std::nullopt); }

  /// For archives (models/archive.hpp). What was found is taken before the next measurement.
  template <class A>
  friend void fields(A& a, ScanDuration& v) {
    auto& [seconds, watch, found] = v;
    static_cast<void>(found);
    a(seconds, watch);
  }

 private:
  double seconds_;
  std::optional<SweepWatch> watch_;
  std::optional<SweepFinder::Found> found_;
};

}  // namespace lamina
