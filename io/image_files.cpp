// libtiff and libpng behind plain functions.
#include <lamina/io/image_files.hpp>

#include <png.h>
#include <tiffio.h>

#include <memory>
#include <ostream>

#include <lamina/io/atomic_file.hpp>
#include <lamina/models/error.hpp>

namespace lamina::io {
namespace {

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using Tiff = std::unique_ptr<TIFF, CloseTiff>;

std::filesystem::path aside_of(const std::filesystem::path& file) {
  std::filesystem::path aside = file;
  return aside.replace_filename("." + file.filename().string() + ".part");
}

}  // namespace

void write_float_tiff(const std::filesystem::path& file, int width, int height,
                      const std::vector<float>& pixels) {
  LAMINA_CHECK(pixels.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const auto aside = aside_of(file);
  {
    const Tiff tiff(TIFFOpen(aside.c_str(), "w"));
    if (!tiff) throw Error(file.string() + ": cannot be written, expected a writable folder");
    TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(width));
    TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(height));
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, 32);
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
    TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff.get(), TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
    TIFFSetField(tiff.get(), TIFFTAG_ROWSPERSTRIP, 64);
    std::vector<float> row(static_cast<std::size_t>(width));
    for (int y = 0; y < height; ++y) {
      const auto first = pixels.begin() + static_cast<std::ptrdiff_t>(y) * width;
      std::copy(first, first + width, row.begin());
      if (TIFFWriteScanline(tiff.get(), row.data(), static_cast<std::uint32_t>(y)) < 0) {
        throw Error(file.string() + ": writing failed, is the disk full?");
      }
    }
  }
  std::filesystem::rename(aside, file);
}

std::vector<float> read_float_tiff(const std::filesystem::path& file, int width, int height) {
  TIFFSetWarningHandler(nullptr);
  TIFFSetErrorHandler(nullptr);
  const Tiff tiff(TIFFOpen(file.c_str(), "r"));
  if (!tiff) throw Error(file.string() + ": cannot be read, expected a TIFF image");
  std::uint32_t w = 0, h = 0;
  std::uint16_t bits = 0, format = 0, samples = 1;
  TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &w);
  TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &h);
  TIFFGetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetField(tiff.get(), TIFFTAG_SAMPLEFORMAT, &format);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, &samples);
  if (w != static_cast<std::uint32_t>(width) || h != static_cast<std::uint32_t>(height) ||
      bits != 32 || format != SAMPLEFORMAT_IEEEFP || samples != 1) {
    throw Error(file.string() + ": found an image of " + std::to_string(w) + " x " +
                std::to_string(h) + ", expected " + std::to_string(width) + " x " +
                std::to_string(height) + " 32-bit floats");
  }
  std::vector<float> pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (std::uint32_t y = 0; y < h; ++y) {
    if (TIFFReadScanline(tiff.get(), pixels.data() + std::size_t{y} * w, y) < 0) {
      throw Error(file.string() + ": row " + std::to_string(y) + " is damaged");
    }
  }
  return pixels;
}

void write_png(const std::filesystem::path& file, int width, int height, int channels,
               const std::vector<std::uint8_t>& pixels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<std::uint32_t>(width);
  image.height = static_cast<std::uint32_t>(height);
  constexpr std::uint32_t kFormats[] = {0, PNG_FORMAT_GRAY, PNG_FORMAT_GA, PNG_FORMAT_RGB,
                                        PNG_FORMAT_RGBA};
  image.format = kFormats[channels];
  png_alloc_size_t size = 0;
  if (!png_image_write_to_memory(&image, nullptr, &size, 0, pixels.data(), 0, nullptr)) {
    throw Error(file.string() + ": cannot be encoded (" + image.message + ")");
  }
  std::string bytes(size, '\0');
  if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels.data(), 0, nullptr)) {
    throw Error(file.string() + ": cannot be encoded (" + image.message + ")");
  }
  bytes.resize(size);
  write_atomically(file, bytes);
}

}  // namespace lamina::io
