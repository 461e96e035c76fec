// Whether two measurements hold the very same numbers.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

namespace lamina {

/// Of the values' bytes, by words: FNV-1a. Equal values give equal hashes; of unequal
/// ones, one pair in 2^64 does.
template <class T>
std::uint64_t content_hash(const std::vector<T>& values) {
  std::uint64_t sum = 0xcbf29ce484222325ULL;
  const std::size_t bytes = values.size() * sizeof(T);
  for (std::size_t i = 0; i < bytes; i += sizeof sum) {
    std::uint64_t word = 0;
    const void* from = values.data() + i / sizeof(T);
    std::memcpy(&word, from, std::min(sizeof word, bytes - i));
    sum = (sum ^ word) * 0x100000001b3ULL;
  }
  return sum;
}

}  // namespace lamina
