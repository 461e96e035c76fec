// How noisy depth images are against what calibration says, over many of them.
#pragma once

#include <array>
#include <cstdint>

#include <lamina/sensors/depth_frame.hpp>

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
  std::array<std::int64_t, 64> counts_{};  ///< of scale in exp(kStep * [k, k + 1))
  std::int64_t images_ = 0;
};

/// By how much rounding depths to whole raw units raises the noise of the model, at the median of
/// the image's depths: sqrt(1 + (u / (sqrt(12) sigma_Z))^2) for a unit u (m). An ideal sensor's
/// noise at a metre is a tenth of a millimetre, the usual unit a whole one. 1 without measurements.
double raised_by_rounding(const DepthFrame& frame);

}  // namespace lamina
