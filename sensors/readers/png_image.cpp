// libpng behind two plain functions. libpng leaves by longjmp: nothing with a destructor lives in
// the functions it may leave.
#include <lamina/sensors/readers/png_image.hpp>

#include <png.h>

#include <bit>
#include <csetjmp>
#include <cstring>

#include <lamina/models/error.hpp>
#include <lamina/sensors/skip_counts.hpp>

namespace lamina {
namespace {
constexpr std::size_t kSignatureBytes = 8;

struct ByteSource {
  const unsigned char* data;
  std::size_t left;
};

void read_bytes(png_structp png, png_bytep out, png_size_t count) {
  auto* source = static_cast<ByteSource*>(png_get_io_ptr(png));
  if (count > source->left) png_error(png, "truncated");
  std::memcpy(out, source->data, count);
  source->data += count;
  source->left -= count;
}

void append_bytes(png_structp png, png_bytep data, png_size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))
      ->append(static_cast<const char*>(static_cast<const void*>(data)), count);
}

void flush_nothing(png_structp) {}
[[noreturn]] void leave(png_structp png, png_const_charp) { png_longjmp(png, 1); }
void ignore(png_structp, png_const_charp) {}

enum class Outcome { kGood, kDamaged, kFormat, kSize };

// The header only: decides before any pixel memory exists.
Outcome read_header(png_structp png, png_infop info, ByteSource* source, int width, int height,
                    bool depth) {
  if (setjmp(png_jmpbuf(png))) return Outcome::kDamaged;
  png_set_read_fn(png, source, read_bytes);
  png_set_user_limits(png, 16384, 16384);
  png_set_chunk_malloc_max(png, 1 << 20);
  png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_WARN_DISCARD);
  png_read_info(png, info);
  const bool grey_16 =
      png_get_bit_depth(png, info) == 16 && png_get_color_type(png, info) == PNG_COLOR_TYPE_GRAY;
  if (depth && !grey_16) return Outcome::kFormat;
  if (png_get_image_width(png, info) != static_cast<png_uint_32>(width) ||
      png_get_image_height(png, info) != static_cast<png_uint_32>(height)) {
    return Outcome::kSize;
  }
  return Outcome::kGood;
}

void convert_to_grey(png_structp png) {
  constexpr png_fixed_point kRed = 29900, kGreen = 58700;  // ITU-R BT.601 luma, in 1e-5
  png_set_expand(png);
  png_set_strip_16(png);
  png_set_strip_alpha(png);
  png_set_rgb_to_gray_fixed(png, PNG_ERROR_ACTION_NONE, kRed, kGreen);
}

Outcome read_pixels(png_structp png, png_infop info, png_bytepp rows, bool depth,
                    std::size_t row_bytes) {
  if (setjmp(png_jmpbuf(png))) return Outcome::kDamaged;
  if (depth) {
    if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
  } else {
    convert_to_grey(png);
  }
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  if (png_get_rowbytes(png, info) != row_bytes) return Outcome::kFormat;
  png_read_image(png, rows);
  png_read_end(png, nullptr);
  return Outcome::kGood;
}

bool write_image(png_structp png, png_infop info, const DepthImage* image, png_bytepp rows,
                 std::string* out) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_write_fn(png, out, append_bytes, flush_nothing);
  png_set_IHDR(png, info, static_cast<png_uint_32>(image->width),
               static_cast<png_uint_32>(image->height), 16, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, 3);
  png_set_filter(png, 0, PNG_FILTER_SUB);
  png_write_info(png, info);
  if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
  png_write_image(png, rows);
  png_write_end(png, nullptr);
  return true;
}

template <typename Pixel>
std::vector<png_bytep> row_pointers(std::vector<Pixel>& pixels, int width, int height) {
  std::vector<png_bytep> rows(static_cast<std::size_t>(height));
  for (std::size_t v = 0; v < rows.size(); ++v) {
    void* row = pixels.data() + v * static_cast<std::size_t>(width);
    rows[v] = static_cast<png_bytep>(row);
  }
  return rows;
}

template <typename Image>
std::optional<Image> decode(std::string_view bytes, int width, int height, std::string& why) {
  LAMINA_CHECK(width > 0 && height > 0);
  using Pixel = typename decltype(Image::pixels)::value_type;
  constexpr bool kDepth = sizeof(Pixel) == 2;
  if (!is_png(bytes)) {
    why = kSkipBadImage;
    return std::nullopt;
  }
  const void* start = bytes.data();
  ByteSource source{static_cast<const unsigned char*>(start), bytes.size()};
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, leave, ignore);
  png_infop info = png_create_info_struct(png);
  Outcome outcome = read_header(png, info, &source, width, height, kDepth);
  Image image;
  if (outcome == Outcome::kGood) {
    image.width = width;
    image.height = height;
    image.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    auto rows = row_pointers(image.pixels, width, height);
    outcome = read_pixels(png, info, rows.data(), kDepth,
                          static_cast<std::size_t>(width) * sizeof(Pixel));
  }
  png_destroy_read_struct(&png, &info, nullptr);
  if (outcome == Outcome::kGood) return image;
  why = outcome == Outcome::kFormat ? kSkipWrongFormat
        : outcome == Outcome::kSize ? kSkipWrongSize
                                    : kSkipBadImage;
  return std::nullopt;
}
}  // namespace

bool is_png(std::string_view bytes) {
  const void* start = bytes.data();
  return bytes.size() >= kSignatureBytes &&
         png_sig_cmp(static_cast<png_const_bytep>(start), 0, kSignatureBytes) == 0;
}

std::optional<DepthImage> decode_png_depth(std::string_view bytes, int expected_width,
                                           int expected_height, std::string& why) {
  return decode<DepthImage>(bytes, expected_width, expected_height, why);
}

std::optional<GreyImage> decode_png_grey(std::string_view bytes, int expected_width,
                                         int expected_height, std::string& why) {
  return decode<GreyImage>(bytes, expected_width, expected_height, why);
}

std::string encode_png_depth(const DepthImage& image) {
  LAMINA_CHECK(image.width > 0 && image.height > 0 &&
               image.pixels.size() ==
                   static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  std::string out;
  std::vector<std::uint16_t> pixels = image.pixels;  // libpng wants them writable
  auto rows = row_pointers(pixels, image.width, image.height);
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, leave, ignore);
  png_infop info = png_create_info_struct(png);
  const bool good = write_image(png, info, &image, rows.data(), &out);
  png_destroy_write_struct(&png, &info);
  LAMINA_CHECK(good);
  return out;
}

}  // namespace lamina
