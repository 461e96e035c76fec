// Time stamps as JSON numbers.
#pragma once

#include <lamina/models/timestamp.hpp>

namespace lamina::io {

/// Seconds: the double nearest to the stamp's decimals, so that the shortest text of it (as JSON
/// writes it) is those decimals, as far as a double holds them: to the nanosecond below 4 million
/// seconds, to 0.2 us at the clocks of today. `Timestamp::seconds()` may be the double beside it.
double decimal_seconds(Timestamp stamp);
/// Of a difference or another time in s: its decimals to the nanosecond. Throws lamina::Error as
/// `Timestamp::from_seconds`.
inline double decimal_seconds(double seconds) {
  return decimal_seconds(Timestamp::from_seconds(seconds));
}

}  // namespace lamina::io
