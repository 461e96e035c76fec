// Clock steps, accidents, jitter and bursts, each by how a stream of a usual period would run.
#include <lamina/sensors/stamp_series.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/median.hpp>
#include <lamina/sensors/time_order.hpp>

namespace lamina {
namespace {

constexpr std::size_t kLevel = 10;    // records to either side of a place that may be a clock step
constexpr std::size_t kDistinct = 4;  // different stamps at least, or they say nothing

// Records without a stamp are given the one before: an equal one, which is laid right later.
std::vector<double> seconds_from(Timestamp origin,
                                 std::span<const std::optional<Timestamp>> recorded) {
  std::vector<double> times;
  double last = 0;
  for (const auto& stamp : recorded) {
    if (stamp) last = *stamp - origin;
    times.push_back(last);
  }
  return times;
}

std::size_t distinct(const std::vector<double>& times) {
  std::vector<double> sorted = times;
  std::sort(sorted.begin(), sorted.end());
  return static_cast<std::size_t>(std::unique(sorted.begin(), sorted.end()) - sorted.begin());
}

std::size_t far_apart(const std::vector<double>& times) {
  return std::max<std::size_t>(1, std::min<std::size_t>(20, times.size() / 3));
}

// Slope over many records: equal stamps and jitter hardly touch it.
double usual_interval(const std::vector<double>& times) {
  const std::size_t over = far_apart(times);
  std::vector<double> slopes;
  for (std::size_t i = over; i < times.size(); ++i) {
    slopes.push_back((times[i] - times[i - over]) / static_cast<double>(over));
  }
  return median(std::move(slopes));
}

// Where record i should be by those of [from, to), and how far these are apart about it.
struct Level {
  double time = 0, spread = 0;
  std::size_t count = 0;
};

Level level_at(const std::vector<double>& times, std::size_t i, std::size_t from, std::size_t to,
               double interval) {
  std::vector<double> at;
  for (std::size_t j = from; j < to; ++j) {
    at.push_back(times[j] + (static_cast<double>(i) - static_cast<double>(j)) * interval);
  }
  Level level{median(at), 0, at.size()};
  for (double& value : at) value = std::abs(value - level.time);
  level.spread = median(std::move(at));
  return level;
}

// How far the clock was set back between the records i - 1 and i; 0: it was not.
double set_back(const std::vector<double>& times, std::size_t i, double interval,
                const SeriesOptions& options) {
  const double gap = times[i] - times[i - 1];
  // Less than half an interval back is a record too many, or late, rather than another clock.
  if (gap > -0.5 * interval && gap < options.longest_pause) return 0;
  const Level before = level_at(times, i, i > kLevel ? i - kLevel : 0, i, interval);
  const Level after = level_at(times, i, i, std::min(times.size(), i + kLevel), interval);
  if (std::min(before.count, after.count) < 3) return 0;
  const double shift = after.time - before.time;
  // Deviations of medians of a few records; five of them are no accident.
  const double sigma = 1.25 * 1.48 * std::hypot(before.spread, after.spread) /
                       std::sqrt(static_cast<double>(std::min(before.count, after.count)));
  return std::abs(shift) > 0.5 * interval + 5 * sigma && shift * gap >= 0 ? -shift : 0;
}

std::vector<ClockStep> take_out_steps(std::vector<double>& times, double interval,
                                      const SeriesOptions& options) {
  const std::vector<double> recorded = times;
  std::vector<ClockStep> steps;
  for (std::size_t i = 1; i < times.size(); ++i) {
    const double back = set_back(times, i, interval, options);
    if (back == 0) continue;
    if (steps.size() == options.most_steps) {
      times = recorded;
      return {};
    }
    steps.push_back({i, back});
    for (std::size_t j = i; j < times.size(); ++j) times[j] += back;
  }
  return steps;
}

bool grows(const std::vector<double>& times, double share) {
  const std::size_t over = far_apart(times);
  std::size_t later = 0;
  for (std::size_t i = over; i < times.size(); ++i) later += times[i] > times[i - over] ? 1 : 0;
  return static_cast<double>(later) >= share * static_cast<double>(times.size() - over);
}

std::vector<std::size_t> unordered(const std::vector<double>& times) {
  std::vector<std::size_t> places;
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (!(times[i] > times[i - 1])) places.push_back(i);
  }
  return places;
}

std::vector<std::size_t> increasing(const std::vector<double>& times) {
  std::vector<Timestamp> stamps;
  for (const double t : times) stamps.push_back(Timestamp::from_seconds(t));
  return longest_increasing(stamps);
}

// What is not of the longest increasing run is laid evenly between its neighbours there.
void lay_between(std::vector<double>& times, const std::vector<std::size_t>& kept,
                 double interval) {
  for (std::size_t k = 0; k + 1 < kept.size(); ++k) {
    const std::size_t a = kept[k], b = kept[k + 1];
    for (std::size_t i = a + 1; i < b; ++i) {
      const double share = static_cast<double>(i - a) / static_cast<double>(b - a);
      times[i] = times[a] + share * (times[b] - times[a]);
    }
  }
  for (std::size_t i = kept.front(); i-- > 0;) times[i] = times[i + 1] - interval;
  for (std::size_t i = kept.back() + 1; i < times.size(); ++i) times[i] = times[i - 1] + interval;
}

// On the usual period, where the stamps about each record have it at the middle: pauses stay. A
// mean over the neighbours that agree smooths what the middle of few leaves.
void lay_on_period(std::vector<double>& times, double interval, const SeriesOptions& options) {
  const std::vector<double> recorded = times;
  const std::size_t n = times.size();
  const auto half_at = [&](std::size_t i) { return std::min({options.half_window, i, n - 1 - i}); };
  std::vector<double> offsets;  // against records that stand one interval apart
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t half = half_at(i);
    offsets.push_back(level_at(recorded, i, i - half, i + half + 1, interval).time -
                      static_cast<double>(i) * interval);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t half = half_at(i);
    double sum = 0, count = 0;
    for (std::size_t j = i - half; j <= i + half; ++j) {
      if (!(std::abs(offsets[j] - offsets[i]) <= 3 * interval)) continue;
      sum += offsets[j];
      count += 1;
    }
    times[i] = static_cast<double>(i) * interval + sum / count;
  }
  for (std::size_t i = 1; i < n; ++i) {
    times[i] = std::max(times[i], times[i - 1] + 0.2 * interval);
  }
}

// A stall, and then at once what was held back: as many as should have come. Gives how many bursts.
std::size_t spread_bursts(std::vector<double>& times, double interval, const SeriesOptions& options,
                          std::vector<std::size_t>& touched) {
  std::size_t bursts = 0, usual = 0, at_once = 0;
  for (std::size_t i = 1; i < times.size(); ++i) {
    const double gap = times[i] - times[i - 1];
    usual += std::abs(gap - interval) < options.as_usual * interval ? 1 : 0;
    at_once += gap < options.burst * interval ? 1 : 0;
  }
  const auto others = static_cast<double>(times.size()) - 1 - static_cast<double>(at_once);
  if (static_cast<double>(usual) < options.periodic * others) return 0;
  for (std::size_t i = 0; i + 3 < times.size(); ++i) {
    if (!(times[i + 1] - times[i] > std::max(options.stall_s, options.stall * interval))) continue;
    std::size_t end = i + 1;
    while (end + 1 < times.size() && times[end + 1] - times[end] < options.burst * interval) ++end;
    const auto count = static_cast<double>(end - i);
    const double due = (times[end] - times[i]) / interval;
    if (end - i < options.burst_count || std::abs(count - due) > std::max(2.0, 0.25 * due))
      continue;
    const double step = (times[end] - times[i]) / count;
    for (std::size_t j = i + 1; j < end; ++j) {
      times[j] = times[i] + static_cast<double>(j - i) * step;
      touched.push_back(j);
    }
    ++bursts;
    i = end - 1;
  }
  return bursts;
}

}  // namespace

bool is_shuffled(std::span<const Timestamp> stamps, const SeriesOptions& options) {
  if (stamps.size() < 2 * kDistinct) return false;
  std::vector<Timestamp> sorted(stamps.begin(), stamps.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<double> gaps;
  std::size_t back = 0;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    gaps.push_back(sorted[i] - sorted[i - 1]);
    back += stamps[i] < stamps[i - 1];
  }
  const double usual = median(gaps);
  const auto as_usual = std::count_if(gaps.begin(), gaps.end(), [&](double gap) {
    return std::abs(gap - usual) < options.as_usual * usual;
  });
  const auto all = static_cast<double>(gaps.size());
  return static_cast<double>(back) > options.few * all &&
         static_cast<double>(as_usual) >= options.periodic * all;
}

std::optional<StampSeries> ordered_stamps(std::span<const std::optional<Timestamp>> recorded,
                                          const SeriesOptions& options) {
  StampSeries series;
  const auto known = std::find_if(recorded.begin(), recorded.end(),
                                  [](const auto& stamp) { return stamp.has_value(); });
  if (known == recorded.end()) return recorded.empty() ? std::optional(series) : std::nullopt;
  const Timestamp origin = **known;
  std::vector<double> times = seconds_from(origin, recorded);
  std::vector<std::size_t> touched = unordered(times);
  series.unordered = touched.size();
  if (series.unordered > 0 && distinct(times) < std::max(kDistinct, times.size() / 50)) {
    return std::nullopt;
  }
  series.interval = usual_interval(times);
  if (series.unordered > 0 && !(series.interval > 0)) return std::nullopt;
  series.steps = take_out_steps(times, series.interval, options);
  for (const ClockStep& step : series.steps) touched.push_back(step.at);
  const bool long_enough = times.size() > options.half_window;
  if (series.unordered > 0 && long_enough && !grows(times, options.growing)) return std::nullopt;
  const std::vector<std::size_t> kept = increasing(times);
  const auto lost = static_cast<double>(times.size() - kept.size());
  if (long_enough && lost > options.few * static_cast<double>(times.size())) {
    lay_on_period(times, series.interval, options);
  } else if (lost > 0) {
    lay_between(times, kept, series.interval);
  }
  series.bursts = spread_bursts(times, series.interval, options, touched);
  if (!touched.empty()) series.first = *std::min_element(touched.begin(), touched.end());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const bool same =
        series.first && recorded[i] && std::abs(*recorded[i] - origin - times[i]) < 1e-7;
    series.stamps.push_back(!series.first || same ? *recorded[i] : origin + times[i]);
    if (series.first && !same) ++series.retimed;
  }
  return series;
}

}  // namespace lamina
