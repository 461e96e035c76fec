// Numbers to indices: what is not a number, or beyond the range, stays within it.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace lamina {

/// x cut towards zero and held within [least, most]; `least` where x is not a number. A plain cast
/// of a negative or too large number is undefined, and ends in loops that never do.
template <class Int>
Int to_whole(double x, Int least, Int most) {
  if (!(x > static_cast<double>(least))) return least;
  return x < static_cast<double>(most) ? static_cast<Int>(x) : most;
}

/// For loops and containers: x cut towards zero, within [0, most].
inline std::size_t to_index(double x, std::size_t most) {
  return to_whole<std::size_t>(x, 0, most);
}

/// The cell of a lattice that x (in sides of a cell) lies in: floor(x), within 2^30 either way, so
/// that cells beside it are numbers, too.
inline std::int32_t to_cell(double x) {
  constexpr std::int32_t kFarthest = 1 << 30;
  return to_whole<std::int32_t>(std::floor(x), -kFarthest, kFarthest);
}

/// The same for lattices finer or wider than that: within 2^62.
inline std::int64_t to_far_cell(double x) {
  constexpr std::int64_t kFarthest = std::int64_t{1} << 62;
  return to_whole<std::int64_t>(std::floor(x), -kFarthest, kFarthest);
}

}  // namespace lamina
