// Every place is tried.
#include <lamina/models/step_change.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <lamina/models/median.hpp>

namespace lamina {

std::optional<StepChange> find_step(const std::vector<double>& values,
                                    const StepChangeOptions& options) {
  std::optional<StepChange> best;
  double least_off = 0;
  for (std::size_t at = options.least; at + options.least <= values.size(); ++at) {
    const auto split = values.begin() + static_cast<std::ptrdiff_t>(at);
    const double before = median(std::vector<double>(values.begin(), split));
    const double after = median(std::vector<double>(split, values.end()));
    std::vector<double> off;
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      off.push_back(std::abs(values[i] - (i < at ? before : after)));
      sum += off.back();
    }
    if (best && sum >= least_off) continue;
    least_off = sum;
    // Of normal values: mean deviations, the largest tenth left out, are 0.63 sigmas; the median
    // of n has 1.25 / sqrt(n).
    std::sort(off.begin(), off.end());
    const std::size_t kept = off.size() - off.size() / 10;
    const double spread =
        std::accumulate(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(kept), 0.0) /
        (0.63 * static_cast<double>(kept));
    const auto n = static_cast<double>(values.size()), m = static_cast<double>(at);
    const double sigma = std::max(1e-12, 1.25 * spread * std::sqrt(1 / m + 1 / (n - m)));
    const double step = std::abs(after - before);
    best = StepChange{at, before, after, step > options.least_spread * spread ? step / sigma : 0};
  }
  return best && best->sigmas >= options.least_sigmas ? best : std::nullopt;
}

}  // namespace lamina
