// Repeats first, then times, then the code for no return.
#include <lamina/models/median.hpp>
#include <lamina/sensors/scan_stream.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {
constexpr double kMoment = 0.02;       // s; the same scan again within it says nothing new
constexpr double kWorthSaying = 0.01;  // share of repeats
constexpr float kReach = 100;          // m: half of the readings of no scanner are further

bool same_ranges(const std::vector<float>& a, const std::vector<float>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](float x, float y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}

// Scans that were written late: put in order, their stamps have the usual interval to those before
// and after. A clock that was set back gives no such stamps.
bool came_late(const std::vector<std::optional<Timestamp>>& stamps) {
  constexpr double kUsual = 0.3, kMost = 0.9, kLongest = 0.4;  // of the interval, of them, s
  std::vector<Timestamp> sorted;
  for (const auto& stamp : stamps) sorted.push_back(*stamp);
  std::sort(sorted.begin(), sorted.end());
  if (sorted.size() < 3) return false;
  std::vector<double> gaps;
  for (std::size_t i = 1; i < sorted.size(); ++i) gaps.push_back(sorted[i] - sorted[i - 1]);
  const double usual = median(gaps);
  std::size_t late = 0, fit = 0;
  Timestamp newest = *stamps.front();
  for (const auto& stamp : stamps) {
    if (*stamp < newest) {
      ++late;
      const auto at = static_cast<std::size_t>(
          std::lower_bound(sorted.begin(), sorted.end(), *stamp) - sorted.begin());
      const auto regular = [&](std::size_t gap) {
        return gap >= gaps.size() || std::abs(gaps[gap] - usual) < kUsual * usual;
      };
      fit += newest - *stamp < kLongest && regular(at) && (at == 0 || regular(at - 1));
    }
    newest = std::max(newest, *stamp);
  }
  return late > 0 && static_cast<double>(fit) >= kMost * static_cast<double>(late);
}
}  // namespace

void ScanStream::add(Timestamp stamp, const std::vector<float>& ranges, double range_min,
                     double range_max, double sweep) {
  sweeps_.push_back(sweep);
  const bool repeat =
      last_stamp_ && std::abs(stamp - *last_stamp_) < kMoment && same_ranges(ranges, last_);
  recorded_.push_back(repeat ? std::nullopt : std::optional(stamp));
  if (repeat) return;
  last_stamp_ = stamp;
  last_ = ranges;
  std::vector<float> returns;
  for (const float range : ranges) {
    const bool within = std::isfinite(range) && static_cast<double>(range) >= range_min;
    const bool returned = within && (!(range_max > 0) || range < static_cast<float>(range_max));
    returns.push_back(returned ? range : HUGE_VALF);
    if (returned) within_.add(range);
    if (within) any_.add(range);
  }
  returns_.add(returns);
}

void ScanStream::Reach::add(float range) {
  ++readings;
  beyond += range > kReach;
  furthest = std::max(furthest, range);
}

void ScanStream::correct(LaserScan& scan) const {
  for (float& range : scan.ranges) {
    if (code_ && range >= static_cast<float>(*code_)) range = HUGE_VALF;
    range *= static_cast<float>(unit_);
  }
  scan.range_min *= unit_;
  if (scan.range_max > static_cast<double>(kReach)) scan.range_max *= unit_;
}

// Indoors and out, the furthest of many readings are 4 to 80 m.
void ScanStream::check_unit() {
  constexpr float kNear = 4, kFar = 80;
  const Reach& reach = 100 * within_.readings < any_.readings ? any_ : within_;
  if (reach.beyond <= reach.readings / 2) return;
  const auto fits = [&](float unit) {
    return reach.furthest * unit >= kNear && reach.furthest * unit <= kFar;
  };
  const bool milli = fits(0.001F), centi = fits(0.01F);
  if (milli != centi) unit_ = milli ? 0.001 : 0.01;
  const char* what = unit_ == 1
                         ? "they were left as they are, and nothing may come of them: divide "
                           "them by 1000 or by 100"
                     : milli ? "taken as millimetres"
                             : "taken as centimetres";
  notes_.warnings.push_back(
      {"range_unit",
       fmt::format("most ranges are beyond {:.0f} m, the furthest {:.0f}: these are no "
                   "metres; {}",
                   kReach, reach.furthest, what)});
}

// A scanner begins no scan before it ended the last.
void ScanStream::check_sweep() {
  constexpr double kLonger = 1.1;  // times the usual interval: stamps are rounded
  std::vector<double> intervals;
  std::optional<Timestamp> last;
  for (const auto& stamp : used_) {
    if (!stamp) continue;
    if (last) intervals.push_back(*stamp - *last);
    last = stamp;
  }
  if (intervals.empty()) return;
  const auto middle = median(intervals);
  longest_sweep_ = kLonger * middle;
  const auto longer = [this](double sweep) { return sweep > longest_sweep_; };
  const auto count = std::count_if(sweeps_.begin(), sweeps_.end(), longer);
  if (static_cast<double>(count) <= kWorthSaying * static_cast<double>(sweeps_.size())) return;
  notes_.warnings.push_back(
      {"time_increment",
       fmt::format(
           "time_increment: {} of {} scans are stated to take longer than the {:.3f} s from "
           "one to the next, the first {:.3f} s: it was not used, and they are taken at one "
           "instant unless their duration is found",
           count, sweeps_.size(), middle, *std::find_if(sweeps_.begin(), sweeps_.end(), longer))});
}

namespace {
Warning repeats_warning(std::size_t repeats, std::size_t scans, const std::string& first) {
  return {"scans_repeated",
          fmt::format("{} of {} scans repeat the one before within 20 ms, first at {}: each is "
                      "used once",
                      repeats, scans, first)};
}
}  // namespace

void ScanStream::finish(const std::function<std::string(std::size_t)>& place, bool sorts) {
  ClockStream stream{"scans", {}, {}};
  std::vector<std::size_t> scans;  // those that are no repeats
  for (std::size_t k = 0; k < recorded_.size(); ++k) {
    if (!recorded_[k]) continue;
    stream.stamps.push_back(recorded_[k]);
    scans.push_back(k);
  }
  ClockOrderOptions options;
  options.place = [&](std::size_t i) { return place(scans[i]); };
  const bool late = sorts && came_late(stream.stamps);
  OrderedClock ordered;
  if (late) ordered.stamps.emplace_back();
  for (const auto& stamp : stream.stamps)
    if (late) ordered.stamps[0].push_back(*stamp);
  if (!late) ordered = order_clocks({&stream, 1}, options);
  used_.assign(recorded_.size(), std::nullopt);
  bool increase = true;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    used_[scans[i]] = ordered.stamps[0][i];
    increase = increase && (i == 0 || *stream.stamps[i] > *stream.stamps[i - 1]);
    if (ordered.stamps[0][i] != *stream.stamps[i])
      restamped_[ordered.stamps[0][i]] = *stream.stamps[i];
  }
  if (!increase) restamped_.clear();
  notes_.warnings = ordered.warnings;
  notes_.remarks = ordered.remarks;
  const std::size_t repeats = recorded_.size() - scans.size();
  if (static_cast<double>(repeats) > kWorthSaying * static_cast<double>(recorded_.size())) {
    const auto first = std::find(recorded_.begin(), recorded_.end(), std::nullopt);
    notes_.warnings.push_back(repeats_warning(
        repeats, recorded_.size(), place(static_cast<std::size_t>(first - recorded_.begin()))));
  }
  check_sweep();
  check_unit();
  if (unit_ == 1) code_ = returns_.code();
  if (code_) notes_.warnings.push_back(returns_.warning(*code_, 0));
}

}  // namespace lamina
