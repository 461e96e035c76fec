// Numbers as compact text for the page: base64 of little-endian typed arrays.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace lamina::viewer {

/// RFC 4648 with padding.
std::string base64(std::span<const std::uint8_t> bytes);
/// As the page's Float32Array reads them, little-endian.
std::string base64(std::span<const float> values);

/// Runs of equal bytes as two: c in 0..127: c + 1 bytes follow as they are; c in 128..255: the next
/// byte stands c - 125 times. Unknown cells, most of any grid, then cost next to nothing.
std::vector<std::uint8_t> run_lengths(std::span<const std::uint8_t> bytes);

/// value ~ least + code / 254 * (largest - least); code 255 is NaN. A layer that is constant has
/// code 0 throughout, one that is NaN throughout has least = largest = 0.
struct Quantised {
  float least = 0, largest = 0;
  std::vector<std::uint8_t> codes;
};
inline constexpr std::uint8_t kNanCode = 255;
/// Infinite values are taken as unknown.
Quantised quantise(std::span<const float> values);

/// How many to skip so that at most `most` of `count` remain, the first of every `stride`.
std::size_t thinning_stride(std::size_t count, std::size_t most);

}  // namespace lamina::viewer
