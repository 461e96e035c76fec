// A histogram of ranges, searched from its far end.
#include <lamina/sensors/no_return_code.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace lamina {

NoReturnCode::NoReturnCode(const NoReturnOptions& options)
    : options_(options),
      readings_(static_cast<std::size_t>(options.furthest / options.bin) + 1),
      scans_(readings_.size()),
      last_scan_(readings_.size()) {}

bool NoReturnCode::moved(std::span<const float> ranges) const {
  if (ranges.size() != counted_.size()) return true;
  std::size_t changed = 0;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const double off = std::abs(static_cast<double>(ranges[i]) - static_cast<double>(counted_[i]));
    changed += off > options_.moved;  // NaN: neither returned
  }
  return static_cast<double>(changed) > options_.moved_share * static_cast<double>(ranges.size());
}

void NoReturnCode::add(std::span<const float> ranges) {
  if (!moved(ranges)) return;
  counted_.assign(ranges.begin(), ranges.end());
  ++scan_count_;
  for (const float range : ranges) {
    if (!std::isfinite(range) || !(range > 0)) continue;
    const auto bin = std::min(readings_.size() - 1,
                              static_cast<std::size_t>(static_cast<double>(range) / options_.bin));
    ++readings_[bin];
    ++all_;
    if (last_scan_[bin] == scan_count_) continue;
    last_scan_[bin] = scan_count_;
    ++scans_[bin];
  }
}

std::optional<double> NoReturnCode::code() const {
  if (all_ < options_.enough) return std::nullopt;
  const auto least = static_cast<std::size_t>(options_.share * static_cast<double>(all_));
  std::size_t beyond = 0;
  std::optional<std::size_t> found;  // the peak may reach further down within its bins
  for (std::size_t end = readings_.size(); end > options_.bins; --end) {
    const std::size_t begin = end - options_.bins;
    if (found && begin + options_.bins <= *found) break;
    const std::size_t peak =
        std::accumulate(readings_.begin() + static_cast<std::ptrdiff_t>(begin),
                        readings_.begin() + static_cast<std::ptrdiff_t>(end), std::size_t{0});
    const bool starts = readings_[begin] > 0 && (begin == 0 || readings_[begin - 1] == 0 ||
                                                 readings_[begin - 1] * 50 < peak);
    if (peak >= least && starts) {
      const auto clear = static_cast<std::size_t>(options_.clear / options_.bin);
      const std::size_t from = begin > clear ? begin - clear : 0;
      const std::size_t before =
          std::accumulate(readings_.begin() + static_cast<std::ptrdiff_t>(from),
                          readings_.begin() + static_cast<std::ptrdiff_t>(begin), std::size_t{0});
      const std::size_t scans =
          *std::max_element(scans_.begin() + static_cast<std::ptrdiff_t>(begin),
                            scans_.begin() + static_cast<std::ptrdiff_t>(end));
      const auto count = static_cast<double>(peak);
      const bool alone =
          static_cast<double>(beyond) <= options_.above * count &&
          static_cast<double>(before) <= options_.below * count &&
          static_cast<double>(scans) >= options_.scans * static_cast<double>(scan_count_);
      if (alone) found = begin;
    }
    beyond += readings_[end - 1];
    // Too much beyond for any peak that may follow.
    if (static_cast<double>(beyond) > options_.above * static_cast<double>(all_)) break;
  }
  if (found) return static_cast<double>(*found) * options_.bin;
  return std::nullopt;
}

double NoReturnCode::share_from(double code) const {
  const auto begin = static_cast<std::ptrdiff_t>(std::lround(code / options_.bin));
  const auto count = std::accumulate(readings_.begin() + begin, readings_.end(), std::size_t{0});
  return all_ > 0 ? static_cast<double>(count) / static_cast<double>(all_) : 0;
}

Warning NoReturnCode::warning(double code, double stated) const {
  const std::string of =
      stated > 0 ? fmt::format(", range_max says {:.4g} m", stated) : std::string();
  return {"no_return_code",
          fmt::format("{:.1f} % of the ranges are {:.2f} m or little more and hardly any lies near "
                      "it{}: that is no wall but the scanner's code for no return, and read so",
                      100 * share_from(code), code, of)};
}

}  // namespace lamina
