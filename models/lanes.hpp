// Four floats side by side: what every x86-64 and arm64 has, through the compiler's vector types.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif
#if defined(__x86_64__)
#include <immintrin.h>
#define LAMINA_AVX2 __attribute__((target("avx2")))
#endif

namespace lamina::lanes {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Short4 = std::uint16_t __attribute__((vector_size(8)));
using Short8 = std::int16_t __attribute__((vector_size(16)));
using Byte8 = std::uint8_t __attribute__((vector_size(8)));

constexpr Float4 kLeft = {-3.5F, -2.5F, -1.5F, -0.5F};  ///< columns of a block from its middle
constexpr Float4 kRight = {0.5F, 1.5F, 2.5F, 3.5F};

inline Float4 load4(const float* p) {
  Float4 x;
  std::memcpy(&x, p, sizeof(x));
  return x;
}
inline void store4(float* p, const Float4& x) { std::memcpy(p, &x, sizeof(x)); }
/// Which of four bytes equal `byte`: lanes all ones or all zeros.
inline Int4 equal4(const std::uint8_t* p, std::uint8_t byte) {
  std::uint32_t four;
  std::memcpy(&four, p, sizeof(four));
#if defined(__SSE2__)
  __m128i x = _mm_cmpeq_epi8(_mm_cvtsi32_si128(static_cast<int>(four)),
                             _mm_set1_epi8(static_cast<char>(byte)));
  x = _mm_unpacklo_epi8(x, x);
  x = _mm_unpacklo_epi16(x, x);
  Int4 mask;
  std::memcpy(&mask, &x, sizeof(mask));
  return mask;
#else
  const std::uint32_t x = byte;
  return Int4{-((four & 255) == x), -(((four >> 8) & 255) == x), -(((four >> 16) & 255) == x),
              -((four >> 24) == x)};
#endif
}
/// Eight lanes of 0 to 255 to eight bytes.
inline void store8(std::uint8_t* p, const Int4& left, const Int4& right) {
#if defined(__SSE2__)
  __m128i a, b;
  std::memcpy(&a, &left, sizeof(a));
  std::memcpy(&b, &right, sizeof(b));
  const __m128i shorts = _mm_packs_epi32(a, b);
  const long long bytes = _mm_cvtsi128_si64(_mm_packus_epi16(shorts, shorts));
  std::memcpy(p, &bytes, 8);
#else
  for (int k = 0; k < 4; ++k) {
    p[k] = static_cast<std::uint8_t>(left[k]);
    p[k + 4] = static_cast<std::uint8_t>(right[k]);
  }
#endif
}
/// Masks, lanes all ones or all zeros, to bytes of the same.
inline Byte8 narrow8(const Int4& left, const Int4& right) {
  Byte8 bytes;
#if defined(__SSE2__)
  __m128i a, b;
  std::memcpy(&a, &left, sizeof(a));
  std::memcpy(&b, &right, sizeof(b));
  const __m128i shorts = _mm_packs_epi32(a, b);
  const long long eight = _mm_cvtsi128_si64(_mm_packs_epi16(shorts, shorts));
  std::memcpy(&bytes, &eight, sizeof(bytes));
#else
  for (int k = 0; k < 4; ++k) {
    bytes[k] = static_cast<std::uint8_t>(left[k]);
    bytes[k + 4] = static_cast<std::uint8_t>(right[k]);
  }
#endif
  return bytes;
}
inline Float4 load4_as_float(const std::uint16_t* p) {
  Short4 x;
  std::memcpy(&x, p, sizeof(x));
  return __builtin_convertvector(__builtin_convertvector(x, Int4), Float4);
}
/// Masks, lanes all ones or all zeros: are all of them, is any of them set?
inline bool all4(const Int4& mask) {
  std::int64_t halves[2];
  std::memcpy(halves, &mask, sizeof(halves));
  return (halves[0] & halves[1]) == -1;
}
inline bool any4(const Int4& mask) {
  std::int64_t halves[2];
  std::memcpy(halves, &mask, sizeof(halves));
  return (halves[0] | halves[1]) != 0;
}
/// a < b ? a : b, lane by lane: b where either is NaN.
inline Float4 least4(const Float4& a, const Float4& b) {
#if defined(__SSE2__)
  __m128 x, y;
  std::memcpy(&x, &a, sizeof(x));
  std::memcpy(&y, &b, sizeof(y));
  x = _mm_min_ps(x, y);
  Float4 result;
  std::memcpy(&result, &x, sizeof(result));
  return result;
#else
  return a < b ? a : b;
#endif
}
/// NaN where the mask is set, x elsewhere.
inline Float4 unless(const Int4& mask, const Float4& x) {
  Int4 bits;
  std::memcpy(&bits, &x, sizeof(bits));
  bits |= mask;
  Float4 result;
  std::memcpy(&result, &bits, sizeof(result));
  return result;
}
inline Float4 all(float x) { return Float4{x, x, x, x}; }
inline float sum4(const Float4& x) { return (x[0] + x[1]) + (x[2] + x[3]); }
/// x where the mask is set, 0 elsewhere: NaN and infinity included.
inline Float4 only(const Int4& mask, const Float4& x) {
  Int4 bits;
  std::memcpy(&bits, &x, sizeof(bits));
  bits &= mask;
  Float4 result;
  std::memcpy(&result, &bits, sizeof(result));
  return result;
}

/// Sums over chosen pixels of four columns of a block, lane by lane; rows from the block's middle.
/// One half at a time is as much as the registers hold.
struct HalfSums {
  Float4 n = {}, y = {}, yy = {}, e = {}, ye = {}, ee = {};

  /// `mask`: which pixels of a row count; `d`: their disparity less a shift; `row` in all lanes.
  void add(const Int4& mask, const Float4& d, const Float4& row) {
    const Float4 x = only(mask, d);
    n += only(mask, Float4{1, 1, 1, 1});
    y += only(mask, row);
    yy += only(mask, row * row);
    e += x;
    ye += x * row;
    ee += x * x;
  }
};

/// Pixels marked `mark`: `rows` rows of four, `stride` and `mark_stride` apart, less `shift`.
inline HalfSums marked_sums(const float* d, std::ptrdiff_t stride, const std::uint8_t* marks,
                            std::ptrdiff_t mark_stride, int rows, float shift, std::uint8_t mark) {
  HalfSums sums;
  Float4 y = all(-0.5F * static_cast<float>(rows - 1));
  for (int r = 0; r < rows; ++r, d += stride, marks += mark_stride, y += 1.0F) {
    sums.add(equal4(marks, mark), load4(d) - shift, y);
  }
  return sums;
}

inline Byte8 load8(const std::uint8_t* p) {
  Byte8 x;
  std::memcpy(&x, p, sizeof(x));
  return x;
}
/// Which of eight bytes equal `byte`: all ones or all zeros.
inline Byte8 equal8(const Byte8& x, std::uint8_t byte) {
  return __builtin_convertvector(x == byte, Byte8);
}

/// A bit in the k-th byte, from the lowest on, for each k-th of eight bytes that differs.
inline std::uint64_t changed8(const std::uint8_t* p, const std::uint8_t* q) {
  const Byte8 differ = ~equal8(load8(p) ^ load8(q), 0) & 1;
  std::uint64_t bits;
  std::memcpy(&bits, &differ, sizeof(bits));
  static_assert(std::endian::native == std::endian::little);
  return bits;
}

/// The same with a bit each: the k-th for the k-th byte.
inline unsigned changed_bits(const std::uint8_t* p, const std::uint8_t* q) {
  return static_cast<unsigned>(changed8(p, q) * 0x0102040810204080ULL >> 56);
}

/// The same of `rows` rows, up to eight: p's side by side, q's `stride` apart; eight bits a row.
inline std::uint64_t changed_bits8(const std::uint8_t* p, const std::uint8_t* q,
                                   std::ptrdiff_t stride, int rows) {
  std::uint64_t bits = 0;
#if defined(__SSE2__)
  if (rows == 8) {
    for (int r = 0; r < 8; r += 2, p += 16, q += 2 * stride) {  // two rows at a time
      const __m128i two =
          _mm_unpacklo_epi64(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(q)),
                             _mm_loadl_epi64(reinterpret_cast<const __m128i*>(q + stride)));
      const __m128i same =
          _mm_cmpeq_epi8(two, _mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
      bits |= static_cast<std::uint64_t>(static_cast<unsigned>(_mm_movemask_epi8(same))) << (8 * r);
    }
    return ~bits;
  }
#endif
  for (int r = 0; r < rows; ++r, p += 8, q += stride) {
    bits |= std::uint64_t{changed_bits(p, q)} << (8 * r);
  }
  return bits;
}

/// How many bytes of `rows` rows of eight, `stride` apart, equal `byte`; at most 31 rows.
inline int count_eights(const std::uint8_t* p, std::ptrdiff_t stride, int rows, std::uint8_t byte) {
  Byte8 sum = {};
  for (int r = 0; r < rows; ++r, p += stride) {
    sum -= equal8(load8(p), byte);  // all ones is -1
  }
  std::uint64_t bytes;
  std::memcpy(&bytes, &sum, sizeof(bytes));
  return static_cast<int>((bytes * 0x0101010101010101ULL) >> 56);
}

/// The same of all eight columns.
struct BlockSums {
  HalfSums half[2];  ///< left and right four

  float count() const { return sum4(half[0].n + half[1].n); }
  float sum_y() const { return sum4(half[0].y + half[1].y); }
  float sum_yy() const { return sum4(half[0].yy + half[1].yy); }
  float sum_e() const { return sum4(half[0].e + half[1].e); }
  float sum_ye() const { return sum4(half[0].ye + half[1].ye); }
  float sum_ee() const { return sum4(half[0].ee + half[1].ee); }
  float sum_x() const { return sum4(half[0].n * kLeft + half[1].n * kRight); }
  float sum_xx() const { return sum4(half[0].n * kLeft * kLeft + half[1].n * kRight * kRight); }
  float sum_xy() const { return sum4(half[0].y * kLeft + half[1].y * kRight); }
  float sum_xe() const { return sum4(half[0].e * kLeft + half[1].e * kRight); }
};

/// Pixels marked `mark` of all eight columns; see marked_sums.
inline BlockSums marked_sums8_portable(const float* d, std::ptrdiff_t stride,
                                       const std::uint8_t* marks, std::ptrdiff_t mark_stride,
                                       int rows, float shift, std::uint8_t mark) {
  BlockSums sums;
  for (int half = 0; half < 2; ++half) {
    sums.half[half] =
        marked_sums(d + 4 * half, stride, marks + 4 * half, mark_stride, rows, shift, mark);
  }
  return sums;
}

#if defined(LAMINA_AVX2)
/// Whether this machine has eight lanes. What uses them gives the same bytes as what does not.
inline bool has_avx2() {
  static const bool has = __builtin_cpu_supports("avx2") != 0;
  return has;
}

LAMINA_AVX2 inline BlockSums marked_sums8_avx2(const float* d, std::ptrdiff_t stride,
                                               const std::uint8_t* marks,
                                               std::ptrdiff_t mark_stride, int rows, float shift,
                                               std::uint8_t mark) {
  const __m256 less = _mm256_set1_ps(shift), one = _mm256_set1_ps(1);
  const __m128i wanted = _mm_set1_epi8(static_cast<char>(mark));
  __m256 n = _mm256_setzero_ps(), y = n, yy = n, e = n, ye = n, ee = n;
  __m256 row = _mm256_set1_ps(-0.5F * static_cast<float>(rows - 1));
  for (int r = 0; r < rows; ++r, d += stride, marks += mark_stride) {
    long long eight;
    std::memcpy(&eight, marks, sizeof(eight));
    const __m128i equal = _mm_cmpeq_epi8(_mm_cvtsi64_si128(eight), wanted);
    const __m256 mask = _mm256_castsi256_ps(_mm256_cvtepi8_epi32(equal));
    const __m256 x = _mm256_and_ps(mask, _mm256_sub_ps(_mm256_loadu_ps(d), less));
    n = _mm256_add_ps(n, _mm256_and_ps(mask, one));
    y = _mm256_add_ps(y, _mm256_and_ps(mask, row));
    yy = _mm256_add_ps(yy, _mm256_and_ps(mask, _mm256_mul_ps(row, row)));
    e = _mm256_add_ps(e, x);
    ye = _mm256_add_ps(ye, _mm256_mul_ps(x, row));
    ee = _mm256_add_ps(ee, _mm256_mul_ps(x, x));
    row = _mm256_add_ps(row, one);
  }
  BlockSums sums;
  const __m256 all[6] = {n, y, yy, e, ye, ee};
  for (int half = 0; half < 2; ++half) {
    HalfSums& h = sums.half[half];
    Float4* const to[6] = {&h.n, &h.y, &h.yy, &h.e, &h.ye, &h.ee};
    for (int i = 0; i < 6; ++i) {
      std::memcpy(to[i], reinterpret_cast<const char*>(&all[i]) + 16 * half, 16);
    }
  }
  return sums;
}
#endif

inline BlockSums marked_sums8(const float* d, std::ptrdiff_t stride, const std::uint8_t* marks,
                              std::ptrdiff_t mark_stride, int rows, float shift,
                              std::uint8_t mark) {
#if defined(LAMINA_AVX2)
  if (has_avx2()) return marked_sums8_avx2(d, stride, marks, mark_stride, rows, shift, mark);
#endif
  return marked_sums8_portable(d, stride, marks, mark_stride, rows, shift, mark);
}

}  // namespace lamina::lanes
