// Eight pixels of a row at a time to the plane that fits each best.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include <lamina/frontend/depth/pixel_labels.hpp>
#include <lamina/models/lanes.hpp>

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
      planes[k] = {{near.plane[k].a * u + kZero, near.plane[k].a * (u + 4) + kZero},
                   near.plane[k].a * kStep,
                   near.plane[k].b + kZero,
                   near.plane[k].c + kZero,
                   near.plane[k].weight + kZero,
                   near.plane[k].offset + kZero,
                   lanes::Int4{} + (near.label[k] + 1)};
    }
  }
  // Best plane for each of eight pixels side by side in row v from the principal point. `least`:
  // the least misfit so far to each of the planes, lane by lane.
  template <bool kMeasure>
  void label(const float* d, float row, float most, std::uint8_t* out, lanes::Float4* least) const {
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
      if constexpr (kMeasure) least[0] = least4(unless(measured[half] <= 0.0F, misfit), least[0]);
    }
    for (std::size_t k = 1; k < count; ++k) {
      const Plane& p = planes[k];
      const Float4 below = p.b * v;
      for (int half = 0; half < 2; ++half) {
        const Float4 misfit = misfit_of(p, half, measured[half], below);
        const Float4 cost = unless(misfit > limit, misfit + p.offset);
        const Int4 better = cost < best[half];
        label[half] = (better & p.mark) | (~better & label[half]);
        best[half] = least4(cost, best[half]);
        if constexpr (kMeasure) least[k] = least4(unless(measured[half] <= 0.0F, misfit), least[k]);
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

// The pixels of a window of up to eight columns, `d` and `out` its first, `stride` from row to row;
// its first column is `u` from the principal point, its first row `v` from the image's, `cy` the
// principal point's.
struct PixelRows {
  const float* d;
  std::uint8_t* out;
  std::ptrdiff_t stride;
  int width, height;
  float u;
  int v;
  double cy;
};
template <bool kMeasure>
void label_rows_portable(const PixelRows& rows, const PixelLabeller::Candidates& candidates,
                         float limit, lanes::Float4* least) {
  constexpr int kRow = PixelColumns::kRow;
  const PixelColumns near(candidates, rows.u);
  const PixelRows r = rows;  // its own: bytes that are written may be anything's
  const float* d = r.d;
  std::uint8_t* out = r.out;
  for (int v = r.v; v < r.v + r.height; ++v, d += r.stride, out += r.stride) {
    const float row = static_cast<float>(v - r.cy);
    if (r.width == kRow) {
      near.label<kMeasure>(d, row, limit, out, least);
      continue;
    }
    float padded[kRow] = {};
    std::uint8_t marks[kRow];
    std::copy(d, d + r.width, padded);
    near.label<kMeasure>(padded, row, limit, marks, least);
    std::copy(marks, marks + r.width, out);
  }
}

#if defined(LAMINA_AVX2)
// What a block's rows have in common is worked out once: how many planes there are is known to the
// compiler.
template <std::size_t kCount>
struct Avx2Planes {
  __m256 start[kCount], step[kCount], b[kCount], c[kCount], weight[kCount], offset[kCount];

  LAMINA_AVX2 Avx2Planes(const PixelLabeller::Candidates& near, float u) {
    const __m256 place = _mm256_setr_ps(u, u, u, u, u + 4, u + 4, u + 4, u + 4);
    const __m256 steps = _mm256_setr_ps(0, 1, 2, 3, 0, 1, 2, 3);
    for (std::size_t k = 0; k < kCount; ++k) {
      const __m256 a = _mm256_set1_ps(near.plane[k].a);
      start[k] = _mm256_mul_ps(a, place);
      step[k] = _mm256_mul_ps(a, steps);
      b[k] = _mm256_set1_ps(near.plane[k].b);
      c[k] = _mm256_set1_ps(near.plane[k].c);
      weight[k] = _mm256_set1_ps(near.plane[k].weight);
      offset[k] = _mm256_set1_ps(near.plane[k].offset);
    }
  }
  LAMINA_AVX2 __m256 misfit(std::size_t k, const __m256& d, const __m256& row) const {
    __m256 plane = _mm256_add_ps(start[k], _mm256_mul_ps(b[k], row));
    plane = _mm256_add_ps(_mm256_add_ps(plane, c[k]), step[k]);
    const __m256 residual = _mm256_sub_ps(d, plane);
    return _mm256_mul_ps(_mm256_mul_ps(weight[k], residual), residual);
  }
};

// The same, eight lanes at a time; eight columns.
template <bool kMeasure, std::size_t kCount>
LAMINA_AVX2 void label_rows_avx2(const PixelRows& rows, const PixelLabeller::Candidates& near,
                                 float most, lanes::Float4* least) {
  const PixelRows r = rows;
  const __m256 limit = _mm256_set1_ps(most), zero = _mm256_setzero_ps();
  const Avx2Planes<kCount> planes(near, r.u);
  __m256 nearest[kCount];
  for (std::size_t k = 0; kMeasure && k < kCount; ++k) {
    nearest[k] = _mm256_broadcast_ps(reinterpret_cast<const __m128*>(&least[k]));
  }
  const float* d = r.d;
  std::uint8_t* out = r.out;
  for (int v = r.v; v < r.v + r.height; ++v, d += r.stride, out += r.stride) {
    const __m256 row = _mm256_set1_ps(static_cast<float>(v - r.cy)), x = _mm256_loadu_ps(d);
    const __m256 measured = _mm256_cmp_ps(x, zero, _CMP_GT_OQ);
    __m256 best = _mm256_set1_ps(1e9F), label = zero;
    for (std::size_t k = 0; k < kCount; ++k) {
      const __m256 misfit = planes.misfit(k, x, row);
      const __m256 cost = _mm256_add_ps(misfit, planes.offset[k]);
      const __m256 better = _mm256_and_ps(_mm256_cmp_ps(misfit, limit, _CMP_LE_OQ),
                                          _mm256_cmp_ps(cost, best, _CMP_LT_OQ));
      const __m256 mark = _mm256_castsi256_ps(_mm256_set1_epi32(near.label[k] + 1));
      label = _mm256_blendv_ps(label, mark, better);
      if (k + 1 < kCount) best = _mm256_blendv_ps(best, cost, better);
      if constexpr (kMeasure) {
        nearest[k] = _mm256_blendv_ps(nearest[k], _mm256_min_ps(misfit, nearest[k]), measured);
      }
    }
    const __m256i marks = _mm256_castps_si256(_mm256_and_ps(label, measured));
    const __m128i shorts =
        _mm_packs_epi32(_mm256_castsi256_si128(marks), _mm256_extracti128_si256(marks, 1));
    const long long bytes = _mm_cvtsi128_si64(_mm_packus_epi16(shorts, shorts));
    std::memcpy(out, &bytes, sizeof(bytes));
  }
  for (std::size_t k = 0; kMeasure && k < kCount; ++k) {
    const __m128 half =
        _mm_min_ps(_mm256_castps256_ps128(nearest[k]), _mm256_extractf128_ps(nearest[k], 1));
    std::memcpy(&least[k], &half, sizeof(half));
  }
}
#endif

template <bool kMeasure>
void label_rows(const PixelRows& rows, const PixelLabeller::Candidates& near, float limit,
                lanes::Float4* least) {
#if defined(LAMINA_AVX2)
  static_assert(PixelLabeller::Candidates::kMost == 6);
  if (rows.width == PixelColumns::kRow && lanes::has_avx2()) {
    switch (near.count) {
      case 1:
        return label_rows_avx2<kMeasure, 1>(rows, near, limit, least);
      case 2:
        return label_rows_avx2<kMeasure, 2>(rows, near, limit, least);
      case 3:
        return label_rows_avx2<kMeasure, 3>(rows, near, limit, least);
      case 4:
        return label_rows_avx2<kMeasure, 4>(rows, near, limit, least);
      case 5:
        return label_rows_avx2<kMeasure, 5>(rows, near, limit, least);
      case 6:
        return label_rows_avx2<kMeasure, 6>(rows, near, limit, least);
      default:
        break;
    }
  }
#endif
  label_rows_portable<kMeasure>(rows, near, limit, least);
}

// Where two planes meet: pixels of either, less than `band` (px) from where their difference is 0,
// go to the one whose side they are on.
struct Crease {
  float slope, band;  // of the difference along a row
  float side;         // 1: `first` where the difference is positive, -1: where it is negative
  std::uint8_t first, second;

  // The pixels of a window, `down` and `middle` what else the difference is made of.
  void settle_rows(const PixelRows& rows, float down, float middle) const {
#if defined(LAMINA_AVX2)
    if (rows.width == PixelColumns::kRow && lanes::has_avx2()) {
      return settle_rows_avx2(rows, down, middle);
    }
#endif
    settle_rows_portable(rows, down, middle);
  }
  void settle_rows_portable(const PixelRows& rows, float down, float middle) const {
    std::uint8_t* out = rows.out;
    for (int v = rows.v; v < rows.v + rows.height; ++v, out += rows.stride) {
      settle(out, rows.width, start_of(rows, v, down, middle));
    }
  }
  // A row of `count` pixels, the difference `start` at the first of them.
  void settle(std::uint8_t* marks, int count, float start) const {
    if (count == PixelColumns::kRow) return settle_eight(marks, start);
    for (int u = 0; u < count; ++u) {
      const float d = start + slope * static_cast<float>(u);
      if ((marks[u] != first && marks[u] != second) || std::abs(d) > band) continue;
      marks[u] = side * d > 0 ? first : second;
    }
  }

 private:
  float start_of(const PixelRows& rows, int v, float down, float middle) const {
    return slope * rows.u + (down * static_cast<float>(v - rows.cy) + middle);
  }
#if defined(LAMINA_AVX2)
  LAMINA_AVX2 void settle_rows_avx2(const PixelRows& rows, float down, float middle) const {
    const PixelRows r = rows;
    const __m256 steps =
        _mm256_mul_ps(_mm256_set1_ps(slope), _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7));
    const __m256 most = _mm256_set1_ps(band), least = _mm256_set1_ps(-band);
    const __m256 turn = _mm256_set1_ps(side), zero = _mm256_setzero_ps();
    const __m256i one = _mm256_set1_epi32(first), two = _mm256_set1_epi32(second);
    std::uint8_t* out = r.out;
    for (int v = r.v; v < r.v + r.height; ++v, out += r.stride) {
      const __m256 d = _mm256_add_ps(_mm256_set1_ps(start_of(r, v, down, middle)), steps);
      const __m256 close =
          _mm256_and_ps(_mm256_cmp_ps(d, most, _CMP_LE_OQ), _mm256_cmp_ps(d, least, _CMP_GE_OQ));
      const __m256 ahead = _mm256_cmp_ps(_mm256_mul_ps(turn, d), zero, _CMP_GT_OQ);
      long long eight;
      std::memcpy(&eight, out, sizeof(eight));
      const __m256i old = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(eight));
      const __m256i theirs =
          _mm256_or_si256(_mm256_cmpeq_epi32(old, one), _mm256_cmpeq_epi32(old, two));
      const __m256i mine = _mm256_and_si256(theirs, _mm256_castps_si256(close));
      const __m256i settled = _mm256_blendv_epi8(two, one, _mm256_castps_si256(ahead));
      const __m256i now = _mm256_blendv_epi8(old, settled, mine);
      const __m128i shorts =
          _mm_packs_epi32(_mm256_castsi256_si128(now), _mm256_extracti128_si256(now, 1));
      eight = _mm_cvtsi128_si64(_mm_packus_epi16(shorts, shorts));
      std::memcpy(out, &eight, sizeof(eight));
    }
  }
#endif
  // Without a branch: which pixels are close is as good as random.
  void settle_eight(std::uint8_t* marks, float start) const {
    using namespace lanes;
    constexpr Float4 kSteps[2] = {{0, 1, 2, 3}, {4, 5, 6, 7}};
    const Float4 left = start + slope * kSteps[0], right = start + slope * kSteps[1];
    const Byte8 close =
        narrow8((left <= band) & (left >= -band), (right <= band) & (right >= -band));
    const Byte8 ahead = narrow8(side * left > 0.0F, side * right > 0.0F);
    const Byte8 old = load8(marks);
    const Byte8 mine = (equal8(old, first) | equal8(old, second)) & close;
    const Byte8 settled = (ahead & first) | (~ahead & second);
    const Byte8 all = (mine & settled) | (~mine & old);
    std::memcpy(marks, &all, sizeof(all));
  }
};

}  // namespace lamina
