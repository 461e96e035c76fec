// PNG images, depth and grey, of a small expected size: decoded in full or refused.
#include <lamina/sensors/readers/png_image.hpp>

#include "fuzz/fuzz_input.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using lamina::fuzz::demand;
  const std::string_view bytes = lamina::fuzz::text_of(data, size);
  std::string why;
  const auto depth = lamina::decode_png_depth(bytes, 8, 6, why);
  demand(depth ? depth->pixels.size() == 48 : !why.empty());
  why.clear();
  const auto grey = lamina::decode_png_grey(bytes, 8, 6, why);
  demand(grey ? grey->pixels.size() == 48 : !why.empty());
  return 0;
}
