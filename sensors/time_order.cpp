// Longest increasing run of stamps, and association of two streams.
#include <lamina/sensors/time_order.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {

std::vector<std::size_t> longest_increasing(std::span<const Timestamp> stamps) {
  // Patience sorting from the end, so that ties favour the earlier entry: tails[k] is the start,
  // with the latest stamp possible, of an increasing run of k + 1 entries.
  constexpr auto kNone = static_cast<std::size_t>(-1);
  std::vector<std::size_t> tails;
  std::vector<std::size_t> successor(stamps.size(), kNone);
  for (std::size_t i = stamps.size(); i-- > 0;) {
    const auto place = std::partition_point(
        tails.begin(), tails.end(), [&](std::size_t tail) { return stamps[tail] > stamps[i]; });
    if (place != tails.begin()) successor[i] = *(place - 1);
    if (place == tails.end()) {
      tails.push_back(i);
    } else {
      *place = i;
    }
  }
  std::vector<std::size_t> kept;
  kept.reserve(tails.size());
  if (tails.empty()) return kept;
  for (std::size_t i = tails.back(); i != kNone; i = successor[i]) kept.push_back(i);
  return kept;
}

std::vector<std::ptrdiff_t> associate_by_time(std::span<const Timestamp> a,
                                              std::span<const Timestamp> b, double tolerance) {
  std::vector<std::ptrdiff_t> result(a.size(), -1);
  std::vector<std::ptrdiff_t> owner(b.size(), -1);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto after = std::lower_bound(b.begin(), b.end(), a[i]);
    std::ptrdiff_t best = -1;
    double best_gap = tolerance;
    for (const auto it : {after, after == b.begin() ? b.end() : after - 1}) {
      if (it == b.end()) continue;
      const double gap = std::abs(*it - a[i]);
      if (gap <= best_gap) {
        best_gap = gap;
        best = it - b.begin();
      }
    }
    if (best < 0) continue;
    std::ptrdiff_t& holder = owner[static_cast<std::size_t>(best)];
    if (holder >= 0) {
      const Timestamp stamp = b[static_cast<std::size_t>(best)];
      if (std::abs(stamp - a[static_cast<std::size_t>(holder)]) <= best_gap) continue;
      result[static_cast<std::size_t>(holder)] = -1;
    }
    holder = static_cast<std::ptrdiff_t>(i);
    result[i] = best;
  }
  return result;
}

}  // namespace lamina
