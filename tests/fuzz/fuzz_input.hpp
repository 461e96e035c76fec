// What every fuzz target starts with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace lamina::fuzz {

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  const void* bytes = data;
  return {static_cast<const char*>(bytes), size};
}

/// Breaks off where a promise is not kept, so that the fuzzer keeps the input.
inline void demand(bool promise) {
  if (!promise) __builtin_trap();
}

}  // namespace lamina::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
