// Which regions are about a block: windows of five blocks by five, looked at as eight bytes at
// once.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace lamina {

/// The labels within two blocks' reach of a block. Without a branch a neighbour: labels of borders
/// are as good as random.
class LabelsAbout {
 public:
  static constexpr std::size_t kMost = 6;
  static constexpr int kReach = 2;
  struct Found {
    std::array<std::int16_t, kMost> label{};
    std::uint8_t count = 0;
    std::uint8_t touching = 0;  ///< bit k: label[k] is the block's own or that of one of the eight
  };

  /// `labels` of blocks row by row, -1: none, below 255.
  void set(std::span<const std::int16_t> labels, int columns, int rows) {
    const std::size_t width = static_cast<std::size_t>(columns);
    stride_ = width + kPad;
    marks_.assign(stride_ * (static_cast<std::size_t>(rows) + 2 * kReach) + kPad, 0);
    const std::int16_t* from = labels.data();
    for (std::size_t r = 0; r < static_cast<std::size_t>(rows); ++r, from += width) {
      std::uint8_t* const to = marks_.data() + (r + kReach) * stride_ + kReach;
      for (std::size_t c = 0; c < width; ++c) to[c] = static_cast<std::uint8_t>(from[c] + 1);
    }
  }

  /// Up to six different ones, in the order in which they appear, row by row.
  Found about(int column, int row) const {
    static_assert(std::endian::native == std::endian::little);
    // The window's rows one behind the other, five bytes each.
    const std::uint8_t* at =
        marks_.data() + static_cast<std::size_t>(row) * stride_ + static_cast<std::size_t>(column);
    std::uint64_t line[5];
    for (std::uint64_t& five : line) {
      std::memcpy(&five, at, sizeof(five));
      five &= 0xFFFFFFFFFFULL;
      at += stride_;
    }
    std::uint64_t left[4] = {line[0] | line[1] << 40, line[1] >> 24 | line[2] << 16 | line[3] << 56,
                             line[3] >> 8 | line[4] << 32, line[4] >> 32};
    Found found;
    while (found.count < kMost && (left[0] | left[1] | left[2] | left[3]) != 0) {
      std::uint64_t first = left[2] != 0 ? left[2] : left[3];
      first = left[1] != 0 ? left[1] : first;
      first = left[0] != 0 ? left[0] : first;
      const std::uint64_t mark = first >> (std::countr_zero(first) & ~7) & 255;
      std::uint64_t near = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        const std::uint64_t others = differing(left[i], mark * kOnes);
        near |= left[i] & ~others & kInner[i];
        left[i] &= others;
      }
      found.label[found.count] = static_cast<std::int16_t>(mark - 1);
      found.touching |= static_cast<std::uint8_t>((near != 0) << found.count);
      ++found.count;
    }
    return found;
  }

 private:
  static constexpr std::size_t kPad = 8;  // the reach on both sides, and what is read beyond
  static constexpr std::uint64_t kOnes = 0x0101010101010101ULL;
  // The three by three in the middle: places 6 to 8, 11 to 13 and 16 to 18.
  static constexpr std::uint64_t kInner[4] = {0xFFFF000000000000ULL, 0x0000FFFFFF0000FFULL,
                                              0x0000000000FFFFFFULL, 0};

  // All ones in the bytes where two differ.
  static std::uint64_t differing(std::uint64_t a, std::uint64_t b) {
    const std::uint64_t x = a ^ b;
    const std::uint64_t high = (((x & 0x7F * kOnes) + 0x7F * kOnes) | x) & 0x80 * kOnes;
    return high | (high - (high >> 7));
  }

  std::size_t stride_ = 0;
  std::vector<std::uint8_t> marks_;  // label + 1, `kReach` rows and columns of 0 about them
};

}  // namespace lamina
