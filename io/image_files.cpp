// libtiff and libpng behind plain functions.
#include <lamina/io/image_files.hpp>

#include <png.h>
#include <tiffio.h>

#include <csetjmp>
#include <iterator>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

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

// Tags of GeoTIFF and GDAL that libtiff does not know by itself.
constexpr std::uint32_t kPixelScale = 33550, kTiePoint = 33922, kGeoKeys = 34735, kNoData = 42113;

void know_geo_tags(TIFF* tiff) {
  static const TIFFFieldInfo fields[] = {
      {kPixelScale, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, const_cast<char*>("ModelPixelScale")},
      {kTiePoint, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, const_cast<char*>("ModelTiepoint")},
      {kGeoKeys, -1, -1, TIFF_SHORT, FIELD_CUSTOM, 1, 1, const_cast<char*>("GeoKeyDirectory")},
      {kNoData, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, const_cast<char*>("GDAL_NODATA")}};
  TIFFMergeFieldInfo(tiff, fields, std::size(fields));
}

void write_place(TIFF* tiff, const RasterPlace& place) {
  const double scale[] = {place.resolution, place.resolution, 0};
  const double tie[] = {0, 0, 0, place.upper_left.x(), place.upper_left.y(), 0};
  // One key: a pixel is an area. The map frame is no frame of the earth.
  const std::uint16_t keys[] = {1, 1, 0, 1, 1025, 0, 1, 1};
  TIFFSetField(tiff, kPixelScale, 3, scale);
  TIFFSetField(tiff, kTiePoint, 6, tie);
  TIFFSetField(tiff, kGeoKeys, 8, keys);
  TIFFSetField(tiff, kNoData, "nan");
}

// libpng jumps where it fails; here nothing with a destructor may be made.
struct PngWriter {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::ostream* out = nullptr;

  explicit PngWriter(std::ostream& to) : out(&to) {
    png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    if (png) info = png_create_info_struct(png);
  }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;
  ~PngWriter() { png_destroy_write_struct(&png, &info); }

  bool begin(int width, int height, int channels) {
    if (!info || setjmp(png_jmpbuf(png))) return false;
    constexpr int kColours[] = {0, PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA,
                                PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGB_ALPHA};
    png_set_write_fn(
        png, out,
        [](png_structp self, png_bytep bytes, png_size_t n) {
          static_cast<std::ostream*>(png_get_io_ptr(self))
              ->write(reinterpret_cast<const char*>(bytes), static_cast<std::streamsize>(n));
        },
        nullptr);
    png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 8,
                 kColours[channels], PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    constexpr int kQuick = 3;  // of 9: the rest of the time buys a few percent
    png_set_compression_level(png, kQuick);
    png_write_info(png, info);
    return true;
  }
  bool row(const std::uint8_t* pixels) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_write_row(png, pixels);
    return true;
  }
  bool end() {
    if (setjmp(png_jmpbuf(png))) return false;
    png_write_end(png, nullptr);
    return true;
  }
};

}  // namespace

void write_float_tiff(const std::filesystem::path& file, int width, int height,
                      const FillRow<float>& fill, const RasterPlace& place) {
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
    know_geo_tags(tiff.get());
    write_place(tiff.get(), place);
    for (int y = 0; y < height; ++y) {
      fill(y, row.data());
      if (TIFFWriteScanline(tiff.get(), row.data(), static_cast<std::uint32_t>(y)) < 0) {
        throw Error(file.string() + ": writing failed, is the disk full?");
      }
    }
  }
  std::filesystem::rename(aside, file);
}

void read_float_tiff(const std::filesystem::path& file, int width, int height,
                     const std::function<void(int y, const float* row)>& take) {
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
  std::vector<float> row(w);
  for (std::uint32_t y = 0; y < h; ++y) {
    if (TIFFReadScanline(tiff.get(), row.data(), y) < 0) {
      throw Error(file.string() + ": row " + std::to_string(y) + " is damaged");
    }
    take(static_cast<int>(y), row.data());
  }
}

void write_png(const std::filesystem::path& file, int width, int height, int channels,
               const FillRow<std::uint8_t>& fill) {
  write_atomically(file, [&](std::ostream& out) {
    PngWriter png(out);
    bool good = png.begin(width, height, channels);
    std::vector<std::uint8_t> row(static_cast<std::size_t>(width) *
                                  static_cast<std::size_t>(channels));
    for (int y = 0; good && y < height; ++y) {
      fill(y, row.data());
      good = png.row(row.data());
    }
    if (!good || !png.end()) throw Error(file.string() + ": cannot be encoded");
  });
}

}  // namespace lamina::io
