// Sums over the last steps.
#include <lamina/frontend/motion/slip_detector.hpp>

namespace lamina {
namespace {

constexpr std::size_t kMost = 10, kLeast = 3;  // steps
constexpr double kSuspected = 9;               // sigmas squared

}  // namespace

void SlipDetector::add(double off, double wheels_variance, double scan_variance) {
  steps_.push_back({off, wheels_variance, scan_variance});
  if (steps_.size() > kMost) steps_.pop_front();
  slips_ = false;
  for (std::size_t n = kLeast; n <= steps_.size(); ++n)
    slips_ = slips_ || chi_squared(n) > kSuspected;
}

void SlipDetector::forget() { *this = {}; }

// The compromise of two with variances w and s is off the former by w / (w + s) of what they differ
// by, whose variance is w + s.
double SlipDetector::chi_squared(std::size_t n) const {
  double off = 0, variance = 0;
  for (std::size_t i = steps_.size() - n; i < steps_.size(); ++i) {
    const Step& step = steps_[i];
    off += step.off;
    variance +=
        step.wheels_variance * step.wheels_variance / (step.wheels_variance + step.scan_variance);
  }
  return variance > 0 ? off * off / variance : 0;
}

}  // namespace lamina
