// Eight pixels of a row at a time to the plane that fits each best.
#pragma once

#include <algorithm>
#include <array>

#include <lamina/frontend/floor/lanes.hpp>
#include <lamina/frontend/floor/pixel_labels.hpp>

namespace lamina {

// The candidates as seen from eight columns, all that is the same for a block's rows worked out.
struct PixelColumns {
  static constexpr int kRow = 8;

  struct Plane {
    lanes::Float4 start[2], step, b, c, weight, offset;  // of the left and the right four
    lanes::Int4 mark;
  };
  std::array<Plane, PixelLabeller::Candidates::kMost> planes;
  std::size_t count = 0;

  PixelColumns(const PixelLabeller::Candidates& near, float u)
      : count(static_cast<std::size_t>(near.count)) {
    constexpr lanes::Float4 kStep = {0, 1, 2, 3}, kZero = {};
    for (std::size_t k = 0; k < count; ++k) {
      planes[k] = {{near.a[k] * u + kZero, near.a[k] * (u + 4) + kZero},
                   near.a[k] * kStep,
                   near.b[k] + kZero,
                   near.c[k] + kZero,
                   near.weight[k] + kZero,
                   near.offset[k] + kZero,
                   lanes::Int4{} + (near.label[k] + 1)};
    }
  }
  // Best plane for each of four pixels side by side in row v from the principal point.
  lanes::Int4 label(const lanes::Float4& d, std::size_t half, const lanes::Float4& v,
                    const lanes::Float4& limit) const {
    lanes::Float4 best = {1e9F, 1e9F, 1e9F, 1e9F};
    lanes::Int4 label = {};
    for (std::size_t k = 0; k < count; ++k) {
      const Plane& p = planes[k];
      const lanes::Float4 r = d - (p.start[half] + p.b * v + p.c + p.step);
      const lanes::Float4 misfit = p.weight * r * r;
      const lanes::Float4 cost = misfit + p.offset;
      const lanes::Int4 better = (misfit <= limit) & (cost < best);
      label = (better & p.mark) | (~better & label);
      best = better ? cost : best;
    }
    return label & (d > 0.0F);
  }
};

// Up to eight pixels side by side.
inline void label_eight(const float* d, int count, const PixelColumns& near, float v, float limit,
                        std::uint8_t* out) {
  constexpr int kRow = PixelColumns::kRow;
  if (count == kRow) {
    const lanes::Float4 row = v + lanes::Float4{}, most = limit + lanes::Float4{};
    lanes::store4(out, near.label(lanes::load4(d), 0, row, most));
    lanes::store4(out + 4, near.label(lanes::load4(d + 4), 1, row, most));
    return;
  }
  float padded[kRow] = {};
  std::uint8_t marks[kRow];
  std::copy(d, d + count, padded);
  label_eight(padded, kRow, near, v, limit, marks);
  std::copy(marks, marks + count, out);
}

}  // namespace lamina
