// 8-bit grey PNG images.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace lamina::sim {

/// Throws lamina::Error when the file cannot be written.
void write_grey_png(const std::filesystem::path& file, int width, int height,
                    const std::vector<std::uint8_t>& pixels);

}  // namespace lamina::sim
