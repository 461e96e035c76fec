// Writes grey images with libpng.
#include <lamina/sim/grey_png.hpp>

#include <png.h>

#include <lamina/models/error.hpp>

namespace lamina::sim {

void write_grey_png(const std::filesystem::path& file, int width, int height,
                    const std::vector<std::uint8_t>& pixels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_GRAY;
  image.flags = PNG_IMAGE_FLAG_FAST;
  if (png_image_write_to_file(&image, file.c_str(), 0, pixels.data(), width, nullptr) == 0) {
    throw input_error(file.string(), "", image.message, "a writable folder");
  }
}

}  // namespace lamina::sim
