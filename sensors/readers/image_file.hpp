// Image files by their expected size.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include <lamina/sensors/readers/png_image.hpp>

namespace lamina {

/// A 16-bit depth PNG. On failure nullopt and a kSkip... reason in `why`.
std::optional<DepthImage> read_depth_image(const std::filesystem::path& file, int width, int height,
                                           std::string& why);

/// "320 x 240, 8 bit grey" from a PNG's header; "no PNG" for anything else: for messages.
std::string image_facts(const std::filesystem::path& file);

/// Width and height from a PNG's header; nullopt for anything else.
std::optional<std::pair<int, int>> image_size(const std::filesystem::path& file);

/// A PNG, or anything else OpenCV reads (JPEG, ...), as 8-bit grey.
std::optional<GreyImage> read_grey_image(const std::filesystem::path& file, int width, int height,
                                         std::string& why);

}  // namespace lamina
