// Counting raw depths.
#include <lamina/models/median.hpp>
#include <lamina/sensors/depth_codes.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

namespace lamina {
namespace {

constexpr double kExact = 0.001, kBeside = 0.03;  // of the value: the code itself, what is near it
constexpr double kVaries = 1.05;                  // of medians: images that show different things

std::int64_t count_in(const std::vector<std::int64_t>& counts, double least, double most) {
  const auto from = static_cast<std::ptrdiff_t>(std::clamp(std::ceil(least), 1.0, 65535.0));
  const auto to = static_cast<std::ptrdiff_t>(std::clamp(std::floor(most), 0.0, 65535.0));
  return to < from ? 0 : std::accumulate(counts.begin() + from, counts.begin() + to + 1, 0LL);
}

}  // namespace

void SaturatedDepths::drop(std::vector<std::uint16_t>& raw) {
  constexpr std::uint16_t kSaturated = 65535;
  const auto found = std::count(raw.begin(), raw.end(), kSaturated);
  pixels_ += static_cast<std::int64_t>(raw.size());
  saturated_ += found;
  images_ += found > 0;
  if (found > 0) std::replace(raw.begin(), raw.end(), kSaturated, std::uint16_t{0});
}

std::optional<Warning> SaturatedDepths::warning() const {
  if (saturated_ == 0 || 1000 * saturated_ < pixels_) return std::nullopt;
  const double percent = 100.0 * static_cast<double>(saturated_) / static_cast<double>(pixels_);
  char text[200];
  std::snprintf(text, sizeof text,
                "raw depth 65535 stands in %.1f %% of the pixels, in %lld images: a code for no "
                "measurement, read as such",
                percent, static_cast<long long>(images_));
  return Warning{"no_return_code", text};
}

void DepthCodes::add(const std::vector<std::uint16_t>& raw) {
  constexpr double kFrequent = 2e-4, kAtLargest = 0.003;
  std::vector<std::int32_t> own(65536, 0);
  for (const std::uint16_t value : raw) ++own[value];
  const auto measured = static_cast<double>(raw.size()) - own[0];
  if (measured <= 0) return;
  Image image;
  double below = 0;
  for (std::size_t value = 1; value < own.size(); ++value) {
    if (own[value] == 0) continue;
    counts_[value] += own[value];
    image.largest = static_cast<std::uint16_t>(value);
    if (own[value] > kFrequent * measured) image.frequent.push_back(image.largest);
    if (2 * below < measured) image.median = image.largest;
    below += own[value];
  }
  for (double v = std::ceil(image.largest * (1 - kAtLargest)); v <= image.largest; ++v) {
    image.at_largest += own[static_cast<std::size_t>(v)] / measured;
  }
  images_.push_back(std::move(image));
}

bool DepthCodes::varies(const std::vector<std::uint16_t>& medians) const {
  const auto [least, most] = std::minmax_element(medians.begin(), medians.end());
  return !medians.empty() && *most > kVaries * *least;
}

std::optional<DepthCodes::Code> DepthCodes::code() const {
  constexpr double kShare = 0.002, kBeyond = 0.01, kRatio = 20, kOfImages = 0.25;
  constexpr std::size_t kLeastImages = 5;
  const double all = static_cast<double>(count_in(counts_, 1, 65535));
  double beyond = 0;  // pixels that lie further than v
  for (double v = 65535; v >= 1; --v) {
    const auto here = static_cast<double>(counts_[static_cast<std::size_t>(v)]);
    if (here < kShare * all) {
      beyond += here;
      if (beyond > kBeyond * all) return std::nullopt;
      continue;
    }
    const double least = std::floor(v * (1 - kExact)), most = std::ceil(v * (1 + kExact));
    const auto own = count_in(counts_, least, most);
    const auto beside = count_in(counts_, v * (1 - kBeside), v * (1 + kBeside)) - own;
    if (beside * kRatio > own) return std::nullopt;
    std::vector<std::uint16_t> medians;
    for (const Image& image : images_) {
      const bool has = std::any_of(image.frequent.begin(), image.frequent.end(),
                                   [&](auto one) { return one >= least && one <= most; });
      if (has) medians.push_back(image.median);
    }
    const double wanted = std::max(static_cast<double>(kLeastImages),
                                   kOfImages * static_cast<double>(images_.size()));
    if (static_cast<double>(medians.size()) < wanted || !varies(medians)) return std::nullopt;
    return Code{static_cast<std::uint16_t>(least),
                static_cast<std::uint16_t>(std::min(most, 65535.0)),
                static_cast<double>(own) / all};
  }
  return std::nullopt;
}

std::optional<double> DepthCodes::common_largest() const {
  constexpr std::size_t kLeastImages = 8;
  constexpr double kAlike = 0.003, kFew = 0.01, kMost = 0.8;
  if (images_.size() < kLeastImages) return std::nullopt;
  std::vector<std::uint16_t> largest, medians;
  for (const Image& image : images_) largest.push_back(image.largest);
  const double usual = lamina::median(largest);
  for (const Image& image : images_) {
    if (std::abs(image.largest - usual) <= kAlike * usual && image.at_largest < kFew) {
      medians.push_back(image.median);
    }
  }
  const bool common =
      static_cast<double>(medians.size()) >= kMost * static_cast<double>(images_.size());
  return common && varies(medians) ? std::optional(usual) : std::nullopt;
}

double DepthCodes::median() const {
  const std::int64_t all = count_in(counts_, 1, 65535);
  std::int64_t below = 0;
  for (std::size_t value = 1; value < counts_.size() && all > 0; ++value) {
    below += counts_[value];
    if (2 * below >= all) return static_cast<double>(value);
  }
  return 0;
}

}  // namespace lamina
