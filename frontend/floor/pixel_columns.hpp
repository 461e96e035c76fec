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
  // Best plane for each of eight pixels side by side in row v from the principal point.
  void label(const float* d, float row, float most, std::uint8_t* out) const {
    using namespace lanes;
    const Float4 v = all(row), limit = all(most);
    const Float4 measured[2] = {load4(d), load4(d + 4)};
    Int4 label[2];
    Float4 best[2];
    const Float4 down = planes[0].b * v;
    for (int half = 0; half < 2; ++half) {
      const Float4 misfit = misfit_of(planes[0], half, measured[half], down);
      const Int4 good = misfit <= limit;
      label[half] = good & planes[0].mark;
      best[half] = good ? misfit + planes[0].offset : all(1e9F);
    }
    for (std::size_t k = 1; k < count; ++k) {
      const Plane& p = planes[k];
      const Float4 below = p.b * v;
      for (int half = 0; half < 2; ++half) {
        const Float4 misfit = misfit_of(p, half, measured[half], below);
        const Float4 cost = misfit + p.offset;
        const Int4 better = (misfit <= limit) & (cost < best[half]);
        label[half] = (better & p.mark) | (~better & label[half]);
        best[half] = better ? cost : best[half];
      }
    }
    store8(out, label[0] & (measured[0] > 0.0F), label[1] & (measured[1] > 0.0F));
  }

 private:
  static lanes::Float4 misfit_of(const Plane& p, int half, const lanes::Float4& d,
                                 const lanes::Float4& down) {
    const lanes::Float4 r = d - (p.start[half] + down + p.c + p.step);
    return p.weight * r * r;
  }
};

// Up to eight pixels side by side.
inline void label_eight(const float* d, int count, const PixelColumns& near, float v, float limit,
                        std::uint8_t* out) {
  constexpr int kRow = PixelColumns::kRow;
  if (count == kRow) {
    near.label(d, v, limit, out);
    return;
  }
  float padded[kRow] = {};
  std::uint8_t marks[kRow];
  std::copy(d, d + count, padded);
  label_eight(padded, kRow, near, v, limit, marks);
  std::copy(marks, marks + count, out);
}

}  // namespace lamina
