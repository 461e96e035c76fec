// Rows of border pixels: eight lanes, four and a plain loop say the same.
#include <gtest/gtest.h>

#include <random>

#include <lamina/frontend/depth/pixel_columns.hpp>

namespace lamina {
namespace {

constexpr int kStride = 11, kRows = 8;
constexpr float kLimit = 12.25F;

struct Case {
  PixelLabeller::Candidates near;
  std::array<float, kStride * kRows> d{};
};

// Planes a few px apart, pixels on one of them each, some missing.
Case draw(int count, std::mt19937& random) {
  std::uniform_real_distribution<float> uniform(0, 1);
  Case c;
  c.near.count = count;
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    c.near.label[k] = static_cast<std::int16_t>(40 * k + 3);
    PixelLabeller::Cost& plane = c.near.plane[k];
    plane.a = 0.1F * uniform(random);
    plane.b = 0.4F * uniform(random);
    plane.c = 20 + 2 * uniform(random);
    plane.weight = 20 * uniform(random) + 5;
    plane.offset = uniform(random);
  }
  for (std::size_t i = 0; i < c.d.size(); ++i) {
    const std::size_t k = random() % static_cast<std::size_t>(count);
    const float u = 100 + static_cast<float>(i % kStride), v = static_cast<float>(i / kStride) - 20;
    const float noise = uniform(random) - 0.5F;
    const PixelLabeller::Cost& plane = c.near.plane[k];
    c.d[i] = random() % 7 == 0 ? 0 : plane.a * u + plane.b * v + plane.c + noise;
  }
  return c;
}

// The plane that fits a pixel best, and the least misfit to each plane of a window.
std::uint8_t best_of(const Case& c, int i, std::array<float, 6>& least) {
  const float u = 100 + static_cast<float>(i % kStride), v = static_cast<float>(i / kStride) - 20;
  const float d = c.d[static_cast<std::size_t>(i)];
  if (!(d > 0)) return 0;
  float best = 1e9F;
  std::uint8_t mark = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(c.near.count); ++k) {
    const PixelLabeller::Cost& plane = c.near.plane[k];
    const float r = d - (plane.a * u + plane.b * v + plane.c);
    const float misfit = plane.weight * r * r, cost = misfit + plane.offset;
    least[k] = std::min(least[k], misfit);
    if (misfit > kLimit || cost >= best) continue;
    best = cost;
    mark = static_cast<std::uint8_t>(c.near.label[k] + 1);
  }
  return mark;
}

TEST(PixelColumns, EightLanesFourAndAPlainLoopLabelAlike) {
  std::mt19937 random(7);
  int labelled = 0, other = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Case c = draw(1 + trial % 6, random);
    for (const int width : {8, 5}) {
      std::array<std::uint8_t, kStride * kRows> portable{}, fast{};
      std::array<lanes::Float4, 6> least_portable, least_fast;
      least_portable.fill(lanes::all(1e30F));
      least_fast.fill(lanes::all(1e30F));
      PixelRows rows{c.d.data(), portable.data(), kStride, width, kRows, 100, 0, 20};
      label_rows_portable<true>(rows, c.near, kLimit, least_portable.data());
      rows.out = fast.data();
      label_rows<true>(rows, c.near, kLimit, least_fast.data());
      ASSERT_EQ(portable, fast);
      std::array<float, 6> least;
      least.fill(1e30F);
      for (int i = 0; i < kStride * kRows; ++i) {
        if (i % kStride >= width) continue;
        const std::uint8_t mark = best_of(c, i, least);
        labelled += mark != 0;
        other += mark != portable[static_cast<std::size_t>(i)];  // rounding may part two
      }
      for (std::size_t k = 0; k < static_cast<std::size_t>(c.near.count); ++k) {
        const auto lowest = [](const lanes::Float4& x) {
          return std::min(std::min(x[0], x[1]), std::min(x[2], x[3]));
        };
        EXPECT_EQ(lowest(least_portable[k]), lowest(least_fast[k]));
        EXPECT_NEAR(lowest(least_portable[k]), least[k], 1e-3F * (1 + least[k]));
      }
    }
  }
  EXPECT_GT(labelled, 10000);
  EXPECT_LE(other, 2);
}

TEST(Crease, EightPixelsAtOnceAreSettledAsOneByOne) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> uniform(-1, 1);
  int settled = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Crease crease{0.3F * uniform(random), 0.5F, trial % 2 == 0 ? 1.0F : -1.0F, 200, 3};
    const float start = uniform(random);
    std::array<std::uint8_t, 8> marks, expected;
    for (auto& mark : marks) mark = std::array<std::uint8_t, 4>{0, 200, 3, 77}[random() % 4];
    expected = marks;
    for (int u = 0; u < 8; ++u)
      crease.settle(&expected[static_cast<std::size_t>(u)], 1,
                    start + crease.slope * static_cast<float>(u));
    const auto before = marks;
    crease.settle(marks.data(), 8, start);
    EXPECT_EQ(marks, expected);
    settled += marks != before;
  }
  EXPECT_GT(settled, 500);
}

TEST(Crease, AWindowIsSettledAsRowByRow) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform(-1, 1);
  int settled = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const Crease crease{0.3F * uniform(random), 0.5F, trial % 2 == 0 ? 1.0F : -1.0F, 200, 3};
    const float down = 0.3F * uniform(random), middle = 2 * uniform(random);
    std::array<std::uint8_t, kStride * kRows> fast;
    for (auto& mark : fast) mark = std::array<std::uint8_t, 4>{0, 200, 3, 77}[random() % 4];
    auto portable = fast, one_by_one = fast;
    const int width = trial % 3 == 0 ? 5 : 8;
    PixelRows rows{nullptr, fast.data(), kStride, width, kRows, -3.5F, 2, 5.5};
    crease.settle_rows(rows, down, middle);
    const auto before = portable;
    rows.out = portable.data();
    crease.settle_rows_portable(rows, down, middle);
    for (int i = 0; i < kStride * kRows; ++i) {
      if (i % kStride >= width) continue;
      const float u = -3.5F + static_cast<float>(i % kStride),
                  v = static_cast<float>(i / kStride) - 3.5F;
      crease.settle(&one_by_one[static_cast<std::size_t>(i)], 1,
                    crease.slope * u + down * v + middle);
    }
    EXPECT_EQ(fast, portable);
    for (std::size_t i = 0; i < fast.size(); ++i) settled += fast[i] != before[i];
    int other = 0;  // rounding may part two
    for (std::size_t i = 0; i < fast.size(); ++i) other += fast[i] != one_by_one[i];
    EXPECT_LE(other, 1);
  }
  EXPECT_GT(settled, 1000);
}

}  // namespace
}  // namespace lamina
