// Bytes of a whole image by a table, many at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <lamina/models/lanes.hpp>

namespace lamina {

/// What every byte becomes: bytes below `count` alone occur, and stay where they are unless said
/// otherwise.
struct ByteTable {
  explicit ByteTable(std::size_t used) : count(used) {
    for (std::size_t k = 0; k < to.size(); ++k) to[k] = static_cast<std::uint8_t>(k);
  }
  std::array<std::uint8_t, 256> to{};
  std::size_t count;
};

/// Sixteen at a time, as often as there are bytes that change: faster than one by one, as few do.
inline void rename_bytes_portable(std::span<std::uint8_t> bytes, const ByteTable& table) {
  using Byte16 = std::uint8_t __attribute__((vector_size(16)));
  std::array<std::uint8_t, 256> changed;
  std::size_t changes = 0;
  for (std::size_t k = 0; k < table.count; ++k) {
    if (table.to[k] != k) changed[changes++] = static_cast<std::uint8_t>(k);
  }
  std::size_t i = 0;
  for (; i + sizeof(Byte16) <= bytes.size(); i += sizeof(Byte16)) {
    Byte16 old;
    std::memcpy(&old, &bytes[i], sizeof(old));
    Byte16 now = old;
    for (std::size_t k = 0; k < changes; ++k) {
      const std::uint8_t from = changed[k], flips = from ^ table.to[from];
      now ^= __builtin_convertvector(old == from, Byte16) & flips;
    }
    std::memcpy(&bytes[i], &now, sizeof(now));
  }
  for (; i < bytes.size(); ++i) bytes[i] = table.to[bytes[i]];
}

#if defined(LAMINA_AVX2)
/// The same where no more than sixteen occur.
LAMINA_AVX2 inline void rename_bytes_avx2(std::span<std::uint8_t> bytes, const ByteTable& table) {
  const __m128i sixteen = _mm_loadu_si128(reinterpret_cast<const __m128i*>(table.to.data()));
  const __m256i to = _mm256_broadcastsi128_si256(sixteen);
  std::size_t i = 0;
  for (; i + 32 <= bytes.size(); i += 32) {
    __m256i* const at = reinterpret_cast<__m256i*>(&bytes[i]);
    _mm256_storeu_si256(at, _mm256_shuffle_epi8(to, _mm256_loadu_si256(at)));
  }
  for (; i < bytes.size(); ++i) bytes[i] = table.to[bytes[i]];
}
#endif

inline void rename_bytes(std::span<std::uint8_t> bytes, const ByteTable& table) {
#if defined(LAMINA_AVX2)
  if (table.count <= 16 && lanes::has_avx2()) return rename_bytes_avx2(bytes, table);
#endif
  rename_bytes_portable(bytes, table);
}

}  // namespace lamina
