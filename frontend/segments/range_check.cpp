// Counts by range, and what they say.
#include <lamina/frontend/segments/range_check.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {

constexpr double kFirst = 0.5, kWider = 1.05;        // m, and from bin to bin
constexpr std::int64_t kScans = 500, kAskEvery = 5;  // scans
// Of chance: returns that must have been seen; shares that stand out (cluttered rooms have up to
// 0.1, chance 0.55 to 0.65).
constexpr std::int64_t kFewestBefore = 1000, kFewest = 300;
constexpr double kClean = 0.1, kChance = 0.55, kBegins = 0.35;
constexpr std::size_t kFirstBins = 3;
// Of codes: a sector so wide in which ranges differ by so little; a flat wall's differ by 0.9 % of
// the range over 15 degrees. Scans that must have one.
constexpr double kSector = 0.26, kFlat = 0.003;  // rad, share of the range
constexpr std::int64_t kFewestSectors = 5;
// Of a reach above range_max: the share of all returns that lie beyond.
constexpr double kManyBeyond = 0.1;

bool is_range(float r) { return std::isfinite(r) && r > 0.0F; }

std::size_t bin_of(double range, std::size_t bins) {
  return to_index(std::log(range / kFirst) / std::log(kWider), bins - 1);
}

double share(std::int64_t part, std::int64_t all) {
  return all > 0 ? static_cast<double>(part) / static_cast<double>(all) : 0.0;
}

}  // namespace

void RangeCheck::add(const LaserScan& scan) {
  if (scans_ >= kScans) return;
  stated_ = scan.range_max;
  for (std::size_t i = 1; i + 1 < scan.size(); ++i) {
    if (!is_range(scan.ranges[i])) continue;
    const double r = static_cast<double>(scan.ranges[i]);
    ++all_;
    const bool beyond = stated_ > 0 && r > 1.001 * stated_;
    beyond_ += beyond;
    largest_ = std::max(largest_, r);
    if (!is_range(scan.ranges[i - 1]) || !is_range(scan.ranges[i + 1])) continue;
    const double left = r - static_cast<double>(scan.ranges[i - 1]),
                 right = r - static_cast<double>(scan.ranges[i + 1]);
    const double gap = 0.1 + 0.02 * r;
    const bool apart = left * right > 0 && std::min(std::abs(left), std::abs(right)) > gap;
    const std::size_t bin = bin_of(r, kBins);
    ++seen_[bin];
    apart_[bin] += apart;
    apart_beyond_ += apart && beyond;
  }
  look_for_sectors(scan);
  if (++scans_ % kAskEvery == 0) decide();
}

// The widest runs of beams whose ranges are one.
void RangeCheck::look_for_sectors(const LaserScan& scan) {
  const auto fewest = static_cast<std::size_t>(
      to_whole(std::ceil(kSector / std::max(1e-4, std::abs(scan.angle_increment))), 8, 100000));
  std::array<bool, kBins> met{};
  float low = 0, high = 0;
  std::size_t run = 0;
  for (const float r : scan.ranges) {
    if (!is_range(r)) {
      run = 0;
      continue;
    }
    const float next_low = run > 0 ? std::min(low, r) : r,
                next_high = run > 0 ? std::max(high, r) : r;
    const bool one = next_high - next_low <= static_cast<float>(kFlat) * next_low;
    low = one ? next_low : r;
    high = one ? next_high : r;
    run = one ? run + 1 : 1;
    if (run < fewest) continue;
    const std::size_t bin = bin_of(static_cast<double>(low), kBins);
    Sector& sector = flat_[bin];
    sector.low = sector.scans > 0 ? std::min(sector.low, static_cast<double>(low))
                                  : static_cast<double>(low);
    sector.scans += !met[bin];
    met[bin] = true;
  }
}

void RangeCheck::decide() {
  find_code();
  const bool coded = code_.has_value();
  // At range_max or beyond, a code is no return by the rules (LaserScan::valid).
  if (coded && stated_ > 0 && *code_ > (1 - 1e-6) * stated_) code_.reset();
  find_noise();
  reach_.reset();
  const bool surfaces = share(apart_beyond_, beyond_) < kClean;
  if (!coded && share(beyond_, all_) > kManyBeyond && surfaces) reach_ = largest_;
}

// The nearest range that sectors of one range have, if hardly anything lies beyond: a code is the
// largest there is, whatever its digits.
void RangeCheck::find_code() {
  constexpr double kBeyondCode = 0.01;  // share of all returns
  code_.reset();
  std::int64_t beyond = 0;
  for (std::size_t k = kBins; k-- > 0;) {
    if (flat_[k].scans >= kFewestSectors && flat_[k].low > 0.9 * largest_) code_ = flat_[k].low;
    beyond += seen_[k];
    if (share(beyond, all_) > kBeyondCode) return;
  }
}

void RangeCheck::find_noise() {
  noise_from_.reset();
  std::int64_t seen = std::accumulate(seen_.begin(), seen_.end(), std::int64_t{0});
  std::int64_t apart = std::accumulate(apart_.begin(), apart_.end(), std::int64_t{0});
  std::int64_t seen_before = 0, apart_before = 0;
  for (std::size_t k = 0; k < kBins && seen >= kFewest; ++k) {
    std::int64_t seen_first = 0, apart_first = 0;
    for (std::size_t m = k; m < std::min(kBins, k + kFirstBins); ++m) {
      seen_first += seen_[m];
      apart_first += apart_[m];
    }
    if (seen_before >= kFewestBefore && share(apart_before, seen_before) < kClean &&
        share(apart, seen) > kChance && share(apart_first, seen_first) > kBegins) {
      noise_from_ = kFirst * std::pow(kWider, static_cast<double>(k));
      share_beyond_ = share(apart, seen);
      share_before_ = share(apart_before, seen_before);
      return;
    }
    seen -= seen_[k], apart -= apart_[k];
    seen_before += seen_[k], apart_before += apart_[k];
  }
}

double RangeCheck::range_max(const LaserScan& scan) const {
  double most = reach_ ? std::max(scan.range_max, 1.01 * *reach_) : scan.range_max;
  if (most <= 0) most = 1e9;
  if (code_) most = std::min(most, (1 - kFlat) * *code_);
  if (noise_from_) most = std::min(most, *noise_from_);
  return most < 1e9 ? most : scan.range_max;
}

}  // namespace lamina
