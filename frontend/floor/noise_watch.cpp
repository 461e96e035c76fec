// Counting, and the middle of the counts.
#include <lamina/frontend/floor/noise_watch.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {

void NoiseWatch::add(double scale) {
  if (!(scale > 0)) return;
  const double last = static_cast<double>(counts_.size()) - 1;
  const double k = std::clamp(std::floor(std::log(scale) / kStep), 0.0, last);
  ++counts_[static_cast<std::size_t>(k)];
  ++images_;
}

double NoiseWatch::median() const {
  if (images_ == 0) return 1;
  std::int64_t below = 0;
  std::size_t k = 0;
  while (k + 1 < counts_.size() && 2 * (below + counts_[k]) < images_) below += counts_[k++];
  return std::exp(kStep * static_cast<double>(k));
}

}  // namespace lamina
