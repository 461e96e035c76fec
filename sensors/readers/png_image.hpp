// PNG images: 16-bit depth and 8-bit grey, read with libpng.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lamina {

/// A 16-bit grey image, row-major.
struct DepthImage {
  int width = 0, height = 0;
  std::vector<std::uint16_t> pixels;
};

/// Decodes a 16-bit grey PNG of exactly the size expected: the header is compared before anything
/// is allocated. On failure nullopt, and `why` is one of the kSkip... reasons of skip_counts.hpp.
std::optional<DepthImage> decode_png_depth(std::string_view bytes, int expected_width,
                                           int expected_height, std::string& why);

/// An 8-bit grey image, row-major.
struct GreyImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};

/// Decodes any PNG of exactly the size expected to 8-bit grey (0.299 R + 0.587 G + 0.114 B).
std::optional<GreyImage> decode_png_grey(std::string_view bytes, int expected_width,
                                         int expected_height, std::string& why);

/// True when the bytes start as a PNG does.
bool is_png(std::string_view bytes);

/// Encodes a 16-bit grey PNG (fast compression).
std::string encode_png_depth(const DepthImage& image);

}  // namespace lamina
