// Which measurements of a stream can be kept so that time never goes back.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <lamina/models/timestamp.hpp>

namespace lamina {

/// Indices, ascending, of a longest strictly increasing run of the stamps: the fewest are dropped,
/// so that one stamp far in the future does not cost all that follow. Of two that exclude each
/// other the earlier in the list stays. O(n log n).
std::vector<std::size_t> longest_increasing(std::span<const Timestamp> stamps);

/// For every entry of `a` the nearest of `b` in time, when nearer than `tolerance` seconds; -1
/// otherwise. No entry of `b` is used twice. Both in increasing time.
std::vector<std::ptrdiff_t> associate_by_time(std::span<const Timestamp> a,
                                              std::span<const Timestamp> b, double tolerance);

}  // namespace lamina
