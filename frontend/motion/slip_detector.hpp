// Wheels that slip a little at every step: no step is wrong by much, all are wrong the same way.
#pragma once

#include <deque>

namespace lamina {

/// Scans and wheels that agree on a place leave it off what wheels said by noise, now ahead, now
/// behind. Where the last 3 to 10 steps are off one way by more than three sigmas in sum, wheels
/// may slip: reason to ask the scan by itself, no more.
class SlipDetector {
 public:
  /// `off`: how much farther both together had the body go than wheels (m). Variances (m^2): the
  /// wheels' by their noise model, and the scan's place along the way by itself.
  void add(double off, double wheels_variance, double scan_variance);
  /// A step that nothing but wheels told, or no wheels did.
  void forget();
  bool slips() const { return slips_; }

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, SlipDetector& v) {
    a(v.steps_, v.slips_);
  }

 private:
  struct Step {
    double off = 0, wheels_variance = 0, scan_variance = 0;
    template <class A>
    friend void fields(A& a, Step& v) {
      a(v.off, v.wheels_variance, v.scan_variance);
    }
  };
  /// Square of the last n steps' sum in sigmas.
  double chi_squared(std::size_t n) const;

  std::deque<Step> steps_;
  bool slips_ = false;
};

}  // namespace lamina
