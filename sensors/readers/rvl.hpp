// RVL: run lengths and variable-length differences of 16-bit depth [Wilson2017].
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace lamina {

/// `pixels` values from `size` bytes; nullopt when the bytes end before, or a
/// run goes beyond them.
std::optional<std::vector<std::uint16_t>> decode_rvl(const unsigned char* bytes, std::size_t size,
                                                     std::size_t pixels);
std::vector<unsigned char> encode_rvl(const std::vector<std::uint16_t>& pixels);

}  // namespace lamina
