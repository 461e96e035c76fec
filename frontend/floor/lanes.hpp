// Four floats side by side: what every x86-64 and arm64 has, through the compiler's vector types.
#pragma once

#include <cstdint>
#include <cstring>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace lamina::lanes {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Short4 = std::uint16_t __attribute__((vector_size(8)));
using Short8 = std::int16_t __attribute__((vector_size(16)));
using Byte16 = std::uint8_t __attribute__((vector_size(16)));

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

}  // namespace lamina::lanes
