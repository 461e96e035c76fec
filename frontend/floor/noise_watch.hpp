// How noisy depth images are against what calibration says, over many of them.
#pragma once

#include <array>
#include <cstdint>

namespace lamina {

/// Each image's noise over the model's (FloorResult::noise_scale), counted in steps of 5 %.
class NoiseWatch {
 public:
  void add(double scale);
  std::int64_t images() const { return images_; }
  /// Median over the images, to 5 %; 1 where there was none.
  double median() const;

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, NoiseWatch& v) {
    a(v.images_);
    for (std::int64_t& n : v.counts_) a(n);
  }

 private:
  static constexpr double kStep = 0.05;    // of the logarithm
  std::array<std::int64_t, 40> counts_{};  ///< of scale in exp(kStep * [k, k + 1))
  std::int64_t images_ = 0;
};

}  // namespace lamina
