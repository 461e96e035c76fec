// Blocks amid their own kind: only the others are looked at pixel by pixel.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace lamina {

/// Into `inner`: the label of every block whose neighbours, the eight about it, have its label,
/// too; -1 for all others. `labels` row by row, -1: none. Whole rows are compared at once.
inline void find_inner(std::span<const std::int16_t> labels, std::size_t columns,
                       std::vector<std::int16_t>& inner, std::vector<std::int16_t>& scratch) {
  inner.assign(labels.begin(), labels.end());
  if (labels.empty()) return;
  // All ones, which is -1, where two differ.
  const auto clear = [](std::int16_t* to, const std::int16_t* a, const std::int16_t* b,
                        std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      to[i] = static_cast<std::int16_t>(to[i] | -(a[i] != b[i]));
    }
  };
  for (std::size_t i = 0; i < labels.size(); i += columns) {
    const std::int16_t* const row = labels.data() + i;
    clear(inner.data() + i, row, row + 1, columns - 1);
    clear(inner.data() + i + 1, row, row + 1, columns - 1);
  }
  // Blocks whose rows beside them are of one label as well.
  scratch = inner;
  const std::size_t rest = labels.size() - columns;
  clear(inner.data(), scratch.data(), scratch.data() + columns, rest);
  clear(inner.data() + columns, scratch.data(), scratch.data() + columns, rest);
}

}  // namespace lamina
