// Where the order of a scanner's beams changes on the way.
#include <algorithm>
#include <cmath>
#include <iterator>

#include <lamina/pipeline/calibration/scanner_check.hpp>

namespace lamina {

ScannerCheck::Pairs ScannerCheck::turns() const {
  Pairs turns = later_;
  std::copy_if(pairs_.begin(), pairs_.end(), std::back_inserter(turns),
               [this](const Pair& p) { return std::abs(p.wheels.yaw) >= options_.turning; });
  std::sort(turns.begin(), turns.end(),
            [](const Pair& a, const Pair& b) { return a.from.stamp < b.from.stamp; });
  return turns;
}

// Two states, as found and with the beams' order reversed, and a price for each change between
// them: the path of least cost through all pairs that turn [Viterbi1967].
std::vector<std::size_t> ScannerCheck::cheapest_states(const std::vector<TwoCosts>& costs) const {
  TwoCosts best{};
  std::vector<std::array<std::size_t, 2>> from;
  for (const TwoCosts& cost : costs) {
    const TwoCosts before = best;
    from.emplace_back();
    for (std::size_t s = 0; s < 2; ++s) {
      const double by_change = before.at(1 - s) + options_.least_gain;
      const bool stays = before.at(s) <= by_change;
      from.back().at(s) = stays ? s : 1 - s;
      best.at(s) = (stays ? before.at(s) : by_change) + cost.at(s);
    }
  }
  std::vector<std::size_t> states(costs.size());
  std::size_t state = best[1] < best[0] ? 1 : 0;
  for (std::size_t i = costs.size(); i-- > 0;) {
    states[i] = state;
    state = from[i].at(state);
  }
  return states;
}

void ScannerCheck::find_changes(Found& found) const {
  ScanCorrection other = found.correction;
  other.mirrored = !other.mirrored;
  const std::vector<Matched> matched = match_all(turns(), {found.correction.aperture, false, 0});
  std::vector<TwoCosts> costs;
  for (const Matched& pair : matched)
    costs.push_back({cost(pair, found.correction), cost(pair, other)});
  const std::vector<std::size_t> states = cheapest_states(costs);
  Found parts = found;
  parts.cost_stated = parts.cost = 0;
  parts.pairs = matched.size();
  const Matched* last = nullptr;  // that is clearly of its state
  std::size_t state = 0;
  for (std::size_t i = 0; i < matched.size(); ++i) {
    parts.cost_stated += costs[i][0];
    parts.cost += costs[i].at(states[i]);
    if (!(costs[i].at(1 - states[i]) - costs[i].at(states[i]) > options_.agrees)) continue;
    const bool changes = last ? states[i] != state : states[i] == 1;
    if (changes && last)
      parts.changes.push_back(
          {last->between.to, std::max(last->between.to, matched[i].between.from)});
    else if (changes)
      parts.correction.mirrored = other.mirrored;
    state = states[i];
    last = &matched[i];
  }
  const bool clear =
      parts.gain() >= options_.least_gain && parts.cost <= options_.most_ratio * parts.cost_stated;
  if (!clear || parts.changes.empty()) return;
  std::vector<Timestamp> middles;
  for (const Between& change : parts.changes) middles.push_back(change.middle());
  parts.correction.reversed = stretches(middles);
  found = parts;
}

std::vector<Stretch> ScannerCheck::stretches(const std::vector<Timestamp>& changes) {
  std::vector<Stretch> all;
  for (std::size_t i = 0; i < changes.size(); i += 2) {
    all.push_back({changes[i], std::nullopt});
    if (i + 1 < changes.size()) all.back().until = changes[i + 1];
  }
  return all;
}

double ScannerCheck::reversal(const LaserScan& one, const LaserScan& next) {
  if (one.size() != next.size()) return 0;
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    const std::size_t j = next.size() - 1 - i;
    if (!one.valid(i) || !next.valid(i) || !next.valid(j)) continue;
    const auto apart = [a = one.ranges[i]](float b) { return std::abs(a - b) / (a + b); };
    sum += double{apart(next.ranges[i])} - double{apart(next.ranges[j])};
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace lamina
