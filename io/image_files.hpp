// Float TIFF and small PNG images, through libtiff and libpng.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>

namespace lamina::io {

/// Writes row `y`, 0 first, where it is told to: images of wide maps are never held whole.
template <class Pixel>
using FillRow = std::function<void(int y, Pixel* row)>;

/// Where a raster lies in the map: resolution and upper left corner, m.
struct RasterPlace {
  double resolution = 1;
  Eigen::Vector2d upper_left = Eigen::Vector2d::Zero();
};

/// One channel of 32-bit floats, deflate-compressed, row 0 first; with GeoTIFF's pixel scale and
/// tie point [GeoTIFF] and GDAL's nodata (nan).
void write_float_tiff(const std::filesystem::path& file, int width, int height,
                      const FillRow<float>& fill, const RasterPlace& place);
/// take(y, row), row 0 first. Throws lamina::Error when the file is no such image or not of this
/// size.
void read_float_tiff(const std::filesystem::path& file, int width, int height,
                     const std::function<void(int y, const float* row)>& take);

/// 8-bit: 1 channel grey, 2 grey and alpha, 3 red green blue, 4 with alpha; row 0 first.
void write_png(const std::filesystem::path& file, int width, int height, int channels,
               const FillRow<std::uint8_t>& fill);

}  // namespace lamina::io
