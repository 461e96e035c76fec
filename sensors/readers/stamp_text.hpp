// Stamps as they are written, and those whose microseconds lack their leading zeros.
#pragma once

#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include <lamina/models/timestamp.hpp>

namespace lamina {

/// "12.345" as a decimal number, and as 12 s and 345 microseconds. Numbers that are no time (too
/// large, smaller than a nanosecond) have neither.
struct StampText {
  std::optional<Timestamp> decimal;
  std::optional<Timestamp> microseconds;  ///< absent where the fraction cannot be a count of them
};

/// nullopt where the text is no number at all.
std::optional<StampText> read_stamp(std::string_view text);

/// Some loggers print seconds and microseconds as "%d.%d": no fraction then begins with a zero, and
/// time seems to go back where the microseconds get a digit more.
class MicrosecondCheck {
 public:
  /// The next stamp of a stream; streams of one logger are checked together.
  void add(const StampText& stamp, int stream = 0);
  /// Read as counts of microseconds, the stamps go back less often, and nothing speaks against it.
  bool found() const;

 private:
  static constexpr int kEnough = 40;  // stamps: one in ten begins with a zero, or none in 1.5 %
  int shorter_ = 0, seen_ = 0, back_decimal_ = 0, back_microseconds_ = 0;
  bool possible_ = true;
  std::map<int, std::pair<Timestamp, Timestamp>> last_;  // by stream, read in either way
};

}  // namespace lamina
