// Exact text form of time stamps.
#include <lamina/models/timestamp.hpp>

#include <charconv>
#include <cmath>
#include <cstdio>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {
constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
constexpr double kLargestSeconds = 4.6e9;  // 146 years: differences fit into int64 nanoseconds, too
}  // namespace

Timestamp Timestamp::from_seconds(double seconds) {
  if (!(std::abs(seconds) <= kLargestSeconds)) {
    throw Error("time: found " + std::to_string(seconds) +
                " s, expected a finite time within 146 years");
  }
  const double whole = std::floor(seconds);
  return Timestamp(static_cast<std::int64_t>(whole) * kNanosecondsPerSecond +
                   static_cast<std::int64_t>(std::llround((seconds - whole) * 1e9)));
}

std::optional<Timestamp> Timestamp::parse(std::string_view text) {
  const bool negative = !text.empty() && text.front() == '-';
  std::string_view rest = negative ? text.substr(1) : text;
  if (rest.empty()) return std::nullopt;
  if (rest.find_first_of("eE") != std::string_view::npos) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    if (!std::isfinite(value) || std::abs(value) > kLargestSeconds) return std::nullopt;
    return from_seconds(value);
  }
  const auto dot = rest.find('.');
  const std::string_view whole_text = rest.substr(0, dot);
  const std::string_view fraction_text =
      dot == std::string_view::npos ? std::string_view() : rest.substr(dot + 1);
  if (whole_text.empty() && fraction_text.empty()) return std::nullopt;
  std::int64_t whole = 0;
  for (char c : whole_text) {
    if (c < '0' || c > '9') return std::nullopt;
    whole = whole * 10 + (c - '0');
    if (static_cast<double>(whole) > kLargestSeconds) return std::nullopt;
  }
  std::int64_t fraction = 0;
  std::int64_t scale = kNanosecondsPerSecond;
  for (char c : fraction_text) {
    if (c < '0' || c > '9') return std::nullopt;
    if (scale == 1) continue;  // below a nanosecond
    scale /= 10;
    fraction += (c - '0') * scale;
  }
  const std::int64_t ns = whole * kNanosecondsPerSecond + fraction;
  return Timestamp(negative ? -ns : ns);
}

std::string Timestamp::to_string() const {
  const bool negative = ns_ < 0;
  const std::uint64_t magnitude =
      negative ? 0 - static_cast<std::uint64_t>(ns_) : static_cast<std::uint64_t>(ns_);
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%s%llu.%09llu", negative ? "-" : "",
                static_cast<unsigned long long>(magnitude / kNanosecondsPerSecond),
                static_cast<unsigned long long>(magnitude % kNanosecondsPerSecond));
  std::string text = buffer;
  for (int i = 0; i < 3 && text.back() == '0'; ++i) text.pop_back();
  return text;
}

}  // namespace lamina
