// Scans and motions in the order they come, for the sweep that they tell.
#pragma once

#include <cstdint>
#include <optional>

#include <lamina/frontend/motion/sweep_finder.hpp>

namespace lamina {

/// Gives a SweepFinder each scan with the velocity between its neighbours: a scan waits for the
/// next one. Where the motion is known more finely than by one pose a scan, its change counts, too;
/// else the difference of two differences would be noise of stamps more than motion. While a robot
/// drives, the finder is asked as soon as its pairs may be enough, and again whenever they are
/// twice as many, until it is sure to 5 % or has all it takes.
class SweepWatch {
 public:
  /// A level scan that states no sweep, and how the body came from the last one; nullopt: nobody
  /// knows. `finely`: by wheels that were read several times in between.
  void add(const LaserScan& scan, const std::optional<SE3>& moved, bool finely = false);
  /// False once more scans would change nothing.
  bool wants_more() const { return finder_.wants_more(); }
  /// By all scans so far; see SweepFinder.
  std::optional<SweepFinder::Found> found() const { return finder_.found(); }
  /// The same when it is worth asking (up to two seconds of work); nullopt at all other times.
  std::optional<SweepFinder::Found> found_on_the_way();
  /// Nothing more is to be expected of found_on_the_way().
  bool done() const { return done_; }

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, SweepWatch& v) {
    a(v.finder_, v.last_, v.before_, v.ask_at_, v.done_);
  }

 private:
  struct Placed {
    LaserScan scan;
    SE3 T_start_body;
    template <class A>
    friend void fields(A& a, Placed& v) {
      a(v.scan, v.T_start_body);
    }
  };
  SweepFinder finder_;
  std::optional<Placed> last_, before_;
  std::uint64_t ask_at_ = 20;  // pairs
  bool done_ = false;
};

}  // namespace lamina
