// A point in time: int64 nanoseconds, because a double cannot hold them for today's clocks.
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace lamina {

class Timestamp {
 public:
  constexpr Timestamp() = default;
  static constexpr Timestamp from_nanoseconds(std::int64_t ns) { return Timestamp(ns); }
  /// Rounds to the nearest nanosecond the double can tell; throws lamina::Error when not finite or
  /// more than 146 years.
  static Timestamp from_seconds(double seconds);
  /// Reads decimal seconds ("1341836538.891350") exactly, without passing through a double; an
  /// exponent is taken through a double. nullopt when the text is no finite number or too large.
  static std::optional<Timestamp> parse(std::string_view text);

  constexpr std::int64_t nanoseconds() const { return ns_; }
  double seconds() const { return static_cast<double>(ns_) * 1e-9; }
  /// Decimal seconds with at least six and at most nine digits; parse() gives it back exactly.
  std::string to_string() const;

  constexpr auto operator<=>(const Timestamp&) const = default;
  /// Seconds from `other` to this.
  double operator-(Timestamp other) const { return static_cast<double>(ns_ - other.ns_) * 1e-9; }
  Timestamp operator+(double seconds) const { return Timestamp(ns_ + from_seconds(seconds).ns_); }

 private:
  constexpr explicit Timestamp(std::int64_t ns) : ns_(ns) {}
  std::int64_t ns_ = 0;
};

}  // namespace lamina
