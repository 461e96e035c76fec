// Random worlds, cameras and scanners through the front-ends: nothing may hang, break or be no
// number. The fuzzer draws from its bytes, tests from a seed.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace lamina {

/// Numbers from bytes, and beyond their end from what these were.
class Draws {
 public:
  explicit Draws(std::span<const std::uint8_t> bytes);
  explicit Draws(std::uint64_t seed) : state_(seed) {}

  double unit();  ///< in [0, 1)
  double between(double low, double high) { return low + (high - low) * unit(); }
  double log_between(double low, double high);
  int below(int n);  ///< 0 to n - 1
  bool chance(double probability) { return unit() < probability; }
  std::uint64_t bits();

 private:
  std::span<const std::uint8_t> bytes_;
  std::uint64_t state_ = 0;
};

/// What a run of frames or scans gave; the longest step by the thread's own clock (s).
struct DrawResult {
  double longest_step_s = 0;
  std::string broken;  ///< the first promise that was not kept; empty: none
};

/// A world of boxes, ramps, stairs, holes and walls by a depth camera anywhere in it, rolled,
/// looking at the sky or from under the floor, with intrinsics and a mounting that need not be
/// right: floor front-end, obstacle scanner, depth odometry.
DrawResult draw_images(Draws& draws);
/// The same by a scanner: segments, scan odometry, and the lines of what was seen.
DrawResult draw_scans(Draws& draws);

}  // namespace lamina
