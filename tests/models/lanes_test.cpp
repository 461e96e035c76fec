// Many at a time say what a plain loop says: lanes of pixels, rows of blocks.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include <lamina/frontend/depth/inner_blocks.hpp>
#include <lamina/frontend/depth/renamed_bytes.hpp>
#include <lamina/models/lanes.hpp>

namespace lamina::lanes {
namespace {

// Bytes and floats with no pattern a lane could hide behind.
std::uint8_t byte_at(int i) { return static_cast<std::uint8_t>((i * 73 + i / 5) % 4); }
float float_at(int i) { return 20.0F + 0.25F * static_cast<float>((i * 37) % 29); }

TEST(Lanes, EqualBytesAreAllOnes) {
  for (int byte = 0; byte < 256; byte += 51) {
    for (int place = 0; place < 16; ++place) {
      std::array<std::uint8_t, 4> four{1, 2, 3, 4};
      for (int k = 0; k < 4; ++k) {
        if ((place >> k) & 1) four[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(byte);
      }
      const Int4 mask = equal4(four.data(), static_cast<std::uint8_t>(byte));
      for (int k = 0; k < 4; ++k) {
        EXPECT_EQ(mask[k], four[static_cast<std::size_t>(k)] == byte ? -1 : 0);
      }
    }
  }
}

TEST(Lanes, ChangedBytesAreABitEach) {
  for (unsigned places = 0; places < 256; ++places) {
    std::array<std::uint8_t, 8> a{7, 0, 255, 1, 128, 9, 254, 3}, b = a;
    for (unsigned k = 0; k < 8; ++k) {
      if ((places >> k & 1U) != 0) b[k] = static_cast<std::uint8_t>(b[k] ^ (1U << k));
    }
    EXPECT_EQ(changed_bits(a.data(), b.data()), places);
  }
}

TEST(Lanes, EightLanesBecomeEightBytes) {
  std::array<std::uint8_t, 10> bytes{};
  store8(bytes.data() + 1, Int4{0, 1, 127, 128}, Int4{129, 254, 255, 7});
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 10>{0, 0, 1, 127, 128, 129, 254, 255, 7, 0}));
}

TEST(Lanes, MarkedSumsAreThoseOfAPlainLoop) {
  constexpr int kRows = 8, kStride = 11;
  std::array<std::uint8_t, kRows * kStride> marks{};
  std::array<float, kRows * kStride> d{};
  for (int i = 0; i < kRows * kStride; ++i) {
    marks[static_cast<std::size_t>(i)] = byte_at(i);
    d[static_cast<std::size_t>(i)] = float_at(i);
  }
  for (const int rows : {8, 5}) {
    BlockSums sums;
    for (int half = 0; half < 2; ++half) {
      sums.half[half] = marked_sums(d.data() + 4 * half, kStride, marks.data() + 4 * half, kStride,
                                    rows, 21.0F, 2);
    }
    double n = 0, x = 0, y = 0, e = 0, xx = 0, xy = 0, yy = 0, xe = 0, ye = 0, ee = 0;
    for (int v = 0; v < rows; ++v) {
      for (int u = 0; u < 8; ++u) {
        const std::size_t i = static_cast<std::size_t>(v * kStride + u);
        if (marks[i] != 2) continue;
        const double px = u - 3.5, py = v - 0.5 * (rows - 1);
        const double pe = static_cast<double>(d[i]) - 21;
        n += 1;
        x += px;
        y += py;
        e += pe;
        xx += px * px;
        xy += px * py;
        yy += py * py;
        xe += px * pe;
        ye += py * pe;
        ee += pe * pe;
      }
    }
    ASSERT_GT(n, 8);
    EXPECT_EQ(sums.count(), n);  // eighths and quarters: floats hold all of these exactly
    EXPECT_EQ(sums.sum_x(), x);
    EXPECT_EQ(sums.sum_y(), y);
    EXPECT_EQ(sums.sum_e(), e);
    EXPECT_EQ(sums.sum_xx(), xx);
    EXPECT_EQ(sums.sum_xy(), xy);
    EXPECT_EQ(sums.sum_yy(), yy);
    EXPECT_EQ(sums.sum_xe(), xe);
    EXPECT_EQ(sums.sum_ye(), ye);
    EXPECT_EQ(sums.sum_ee(), ee);
  }
}

TEST(Lanes, EightColumnsAtOnceSumAsTwoHalves) {
  std::array<std::uint8_t, 80> marks{};
  std::array<float, 80> d{};
  for (std::size_t i = 0; i < d.size(); ++i) {
    marks[i] = byte_at(static_cast<int>(i));
    d[i] = 20.0F + 1.0F / static_cast<float>(i + 3);  // inexact: the order of sums tells
  }
  for (const int rows : {8, 5}) {
    const BlockSums a = marked_sums8(d.data(), 10, marks.data(), 10, rows, 20.1F, 2);
    const BlockSums b = marked_sums8_portable(d.data(), 10, marks.data(), 10, rows, 20.1F, 2);
    ASSERT_GT(b.count(), 0);
    EXPECT_EQ(std::memcmp(&a, &b, sizeof(a)), 0);
  }
}

TEST(Lanes, BytesAreCountedComparedAndNarrowed) {
  std::array<std::uint8_t, 40> p{}, q{};
  for (std::size_t i = 0; i < p.size(); ++i) {
    p[i] = byte_at(static_cast<int>(i));
    q[i] = i % 3 == 0 ? static_cast<std::uint8_t>(p[i] + 128) : p[i];
  }
  int expected = 0;
  for (int r = 0; r < 4; ++r) {
    for (int k = 0; k < 8; ++k) expected += p[static_cast<std::size_t>(10 * r + k)] == 2;
  }
  ASSERT_GT(expected, 0);
  EXPECT_EQ(count_eights(p.data(), 10, 4, 2), expected);
  std::uint64_t differ = 0;
  for (std::size_t k = 0; k < 8; ++k) differ |= (k % 3 == 0 ? 1ULL : 0ULL) << (8 * k);
  EXPECT_EQ(changed8(p.data(), q.data()), differ);
  const Byte8 bytes = narrow8(Int4{-1, 0, 0, -1}, Int4{0, -1, -1, 0});
  for (int k = 0; k < 8; ++k) {
    EXPECT_EQ(bytes[k], k == 0 || k == 3 || k == 5 || k == 6 ? 255 : 0) << k;
  }
}

TEST(Lanes, TheLeastPassesOverWhatIsMasked) {
  const Float4 least = least4(unless(Int4{0, -1, 0, 0}, Float4{1, 2, 3, 4}), Float4{2, 3, 2, 4});
  EXPECT_EQ(least[0], 1);
  EXPECT_EQ(least[1], 3);
  EXPECT_EQ(least[2], 2);
  EXPECT_EQ(least[3], 4);
}

TEST(Lanes, ChangedBytesOfRowsAreABitEach) {
  std::array<std::uint8_t, 64> a{};
  std::array<std::uint8_t, 80> b{};
  for (std::size_t trial = 0; trial < 70; ++trial) {
    for (int rows = 1; rows <= 8; ++rows) {
      std::uint64_t expected = 0;
      for (std::size_t i = 0; i < 8 * static_cast<std::size_t>(rows); ++i) {
        const bool differs = trial == i || (trial > 64 && (i * i + i / 3) % trial < 20);
        a[i] = byte_at(static_cast<int>(i + trial));
        b[10 * (i / 8) + i % 8] = static_cast<std::uint8_t>(differs ? a[i] ^ 129 : a[i]);
        expected |= static_cast<std::uint64_t>(differs) << i;
      }
      EXPECT_EQ(changed_bits8(a.data(), b.data(), 10, rows), expected) << trial << " " << rows;
    }
  }
}

TEST(RenamedBytes, ManyAtATimeAreRenamedAsOneByOne) {
  for (const std::size_t count : {1, 2, 9, 16, 17, 255}) {
    ByteTable table(count);
    for (std::size_t k = 1; k < count; ++k) {  // one is dropped, those behind it close up
      table.to[k] = static_cast<std::uint8_t>(k == 3 ? 0 : k > 3 ? k - 1 : k);
    }
    for (const std::size_t size : {0, 5, 16, 31, 32, 100, 333}) {
      std::vector<std::uint8_t> bytes(size), expected(size);
      for (std::size_t i = 0; i < size; ++i) {
        bytes[i] = static_cast<std::uint8_t>((i * i + 7 * i) % count);
        expected[i] = table.to[bytes[i]];
      }
      std::vector<std::uint8_t> portable = bytes;
      rename_bytes(bytes, table);
      rename_bytes_portable(portable, table);
      EXPECT_TRUE(bytes == expected) << count << " " << size;
      EXPECT_TRUE(portable == expected) << count << " " << size;
    }
  }
}

TEST(InnerBlocks, HaveEightNeighboursOfTheirKind) {
  constexpr int kColumns = 37, kRows = 23;
  std::vector<std::int16_t> labels(kColumns * kRows);
  for (int i = 0; i < kColumns * kRows; ++i) {
    const int c = i % kColumns, r = i / kColumns;
    labels[static_cast<std::size_t>(i)] =
        static_cast<std::int16_t>((c * c + 3 * r * r) % 97 == 0 ? -1 : (c > 20) + 2 * (r > 11));
  }
  std::vector<std::int16_t> inner, scratch;
  find_inner(labels, kColumns, inner, scratch);
  int found = 0;
  for (int i = 0; i < kColumns * kRows; ++i) {
    std::int16_t expected = labels[static_cast<std::size_t>(i)];
    for (int r = std::max(0, i / kColumns - 1); r <= std::min(kRows - 1, i / kColumns + 1); ++r) {
      for (int c = std::max(0, i % kColumns - 1); c <= std::min(kColumns - 1, i % kColumns + 1);
           ++c) {
        if (labels[static_cast<std::size_t>(r * kColumns + c)] !=
            labels[static_cast<std::size_t>(i)]) {
          expected = -1;
        }
      }
    }
    EXPECT_EQ(inner[static_cast<std::size_t>(i)], expected) << i;
    found += expected >= 0;
  }
  EXPECT_GT(found, 200);
  find_inner({}, 0, inner, scratch);
  EXPECT_TRUE(inner.empty());
}

}  // namespace
}  // namespace lamina::lanes
