// Images that a list has twice.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace lamina {

/// The text of a list (`timestamp path`) in which lines are comments whose stamp is that of the
/// line before and whose image is the same, byte by byte: a driver or a converter that wrote one
/// image twice says nothing of the clock. `repeats`: how many.
std::string without_repeated_images(std::string text, const std::filesystem::path& folder,
                                    std::int64_t& repeats);

}  // namespace lamina
