// Four floats side by side: what every x86-64 and arm64 has, through the compiler's vector types.
#pragma once

#include <cstdint>
#include <cstring>

namespace lamina::lanes {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Short4 = std::uint16_t __attribute__((vector_size(8)));
using Byte4 = std::uint8_t __attribute__((vector_size(4)));

constexpr Float4 kLeft = {-3.5F, -2.5F, -1.5F, -0.5F};  ///< columns of a block from its middle
constexpr Float4 kRight = {0.5F, 1.5F, 2.5F, 3.5F};

inline Float4 load4(const float* p) {
  Float4 x;
  std::memcpy(&x, p, sizeof(x));
  return x;
}
inline void store4(float* p, const Float4& x) { std::memcpy(p, &x, sizeof(x)); }
inline Int4 load4(const std::uint8_t* p) {
  Byte4 x;
  std::memcpy(&x, p, sizeof(x));
  return __builtin_convertvector(x, Int4);
}
inline void store4(std::uint8_t* p, const Int4& x) {
  const Byte4 bytes = __builtin_convertvector(x, Byte4);
  std::memcpy(p, &bytes, sizeof(bytes));
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

/// Sums over chosen pixels of a block of eight columns, lane by lane; rows from the block's middle.
struct BlockSums {
  Float4 n[2] = {{}, {}}, y[2] = {{}, {}}, yy[2] = {{}, {}};
  Float4 e[2] = {{}, {}}, ye[2] = {{}, {}}, ee[2] = {{}, {}};

  /// `half`: 0 left, 1 right four; `mask`: which of them count; `d`: their disparity less a shift.
  void add(int half, const Int4& mask, const Float4& d, float row) {
    const Float4 m = only(mask, Float4{1, 1, 1, 1});
    const Float4 x = only(mask, d);
    const Float4 z = m * row;
    n[half] += m;
    y[half] += z;
    yy[half] += z * row;
    e[half] += x;
    ye[half] += x * row;
    ee[half] += x * x;
  }
  float count() const { return sum4(n[0] + n[1]); }
  float sum_y() const { return sum4(y[0] + y[1]); }
  float sum_yy() const { return sum4(yy[0] + yy[1]); }
  float sum_e() const { return sum4(e[0] + e[1]); }
  float sum_ye() const { return sum4(ye[0] + ye[1]); }
  float sum_ee() const { return sum4(ee[0] + ee[1]); }
  float sum_x() const { return sum4(n[0] * kLeft + n[1] * kRight); }
  float sum_xx() const { return sum4(n[0] * kLeft * kLeft + n[1] * kRight * kRight); }
  float sum_xy() const { return sum4(y[0] * kLeft + y[1] * kRight); }
  float sum_xe() const { return sum4(e[0] * kLeft + e[1] * kRight); }
};

}  // namespace lamina::lanes
