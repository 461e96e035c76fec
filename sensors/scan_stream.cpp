// Repeats first, then times, then the code for no return.
#include <lamina/sensors/scan_stream.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {
constexpr double kMoment = 0.02;       // s; the same scan again within it says nothing new
constexpr double kWorthSaying = 0.01;  // share of repeats

bool same_ranges(const std::vector<float>& a, const std::vector<float>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](float x, float y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}
}  // namespace

void ScanStream::add(Timestamp stamp, const std::vector<float>& ranges, double range_min,
                     double range_max) {
  const bool repeat =
      last_stamp_ && std::abs(stamp - *last_stamp_) < kMoment && same_ranges(ranges, last_);
  recorded_.push_back(repeat ? std::nullopt : std::optional(stamp));
  if (repeat) return;
  last_stamp_ = stamp;
  last_ = ranges;
  std::vector<float> returns;
  for (const float range : ranges) {
    const bool within = std::isfinite(range) && static_cast<double>(range) >= range_min;
    if (within && (!(range_max > 0) || range < static_cast<float>(range_max)))
      returns.push_back(range);
  }
  returns_.add(returns);
}

void ScanStream::take_out_codes(std::vector<float>& ranges) const {
  if (!code_) return;
  for (float& range : ranges) {
    if (range >= static_cast<float>(*code_)) range = HUGE_VALF;
  }
}

void ScanStream::finish(const std::function<std::string(std::size_t)>& place) {
  ClockStream stream{"scans", {}, {}};
  std::vector<std::size_t> scans;  // those that are no repeats
  for (std::size_t k = 0; k < recorded_.size(); ++k) {
    if (!recorded_[k]) continue;
    stream.stamps.push_back(recorded_[k]);
    scans.push_back(k);
  }
  ClockOrderOptions options;
  options.place = [&](std::size_t i) { return place(scans[i]); };
  const OrderedClock ordered = order_clocks({&stream, 1}, options);
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
    notes_.warnings.push_back(
        {"scans_repeated",
         fmt::format("{} of {} scans repeat the one before within 20 ms, first at {}: each is used "
                     "once",
                     repeats, recorded_.size(),
                     place(static_cast<std::size_t>(first - recorded_.begin())))});
  }
  code_ = returns_.code();
  if (code_) notes_.warnings.push_back(returns_.warning(*code_, 0));
}

}  // namespace lamina
