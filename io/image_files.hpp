// Float TIFF and small PNG images, through libtiff and libpng.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace lamina::io {

/// One channel of 32-bit floats, deflate-compressed, row 0 first.
void write_float_tiff(const std::filesystem::path& file, int width, int height,
                      const std::vector<float>& pixels);
/// Throws lamina::Error when the file is no such image or not of this size.
std::vector<float> read_float_tiff(const std::filesystem::path& file, int width, int height);

/// 8-bit: 1 channel grey, 2 grey and alpha, 3 red green blue, 4 with alpha; row 0 first.
void write_png(const std::filesystem::path& file, int width, int height, int channels,
               const std::vector<std::uint8_t>& pixels);

}  // namespace lamina::io
