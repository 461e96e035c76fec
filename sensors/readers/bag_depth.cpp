// Encodings of [REP118], and image_transport's compressedDepth.
#include <lamina/sensors/readers/bag_depth.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>

#include <lamina/models/median.hpp>
#include <lamina/sensors/readers/png_image.hpp>
#include <lamina/sensors/readers/rvl.hpp>

namespace lamina::bag {
namespace {
constexpr std::uint32_t kLargestImage = 16384;

std::uint16_t to_millimetres(float value, float unit) {
  const float metres = value * unit;
  if (!(metres > 0) || !(metres < 65.535f)) return 0;  // false for NaN
  return static_cast<std::uint16_t>(std::lround(metres * 1000.0f));
}

// No camera measures at hundreds of metres: such values are millimetres. 0: hardly any value.
std::optional<float> unit_of(std::vector<float> values) {
  constexpr std::size_t kEnough = 50;
  constexpr float kFar = 100;  // m
  values.erase(std::remove_if(values.begin(), values.end(),
                              [](float v) { return !(v > 0) || !std::isfinite(v); }),
               values.end());
  if (values.size() < kEnough) return std::nullopt;
  return median(values) > kFar ? 0.001f : 1.0f;
}

bool is_size(std::uint32_t width, std::uint32_t height) {
  return width > 0 && height > 0 && width <= kLargestImage && height <= kLargestImage;
}

std::uint32_t little_endian(const unsigned char* bytes) {
  return bytes[0] | std::uint32_t{bytes[1]} << 8 | std::uint32_t{bytes[2]} << 16 |
         std::uint32_t{bytes[3]} << 24;
}

std::uint32_t big_endian(const unsigned char* bytes) {
  return bytes[3] | std::uint32_t{bytes[2]} << 8 | std::uint32_t{bytes[1]} << 16 |
         std::uint32_t{bytes[0]} << 24;
}

float as_float(std::uint32_t bits) {
  float value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

bool begin_depth(Message& out, std::uint32_t width, std::uint32_t height) {
  if (!is_size(width, height)) return false;
  out.width = static_cast<int>(width);
  out.height = static_cast<int>(height);
  return true;
}

bool unpack_png(const unsigned char* data, std::size_t size, Message& out) {
  // Signature, then length, name, width and height of IHDR.
  if (size < 24 || !begin_depth(out, big_endian(data + 16), big_endian(data + 20))) return false;
  std::string why;
  const void* bytes = data;
  auto image =
      decode_png_depth({static_cast<const char*>(bytes), size}, out.width, out.height, why);
  if (!image) return false;
  out.depth = std::move(image->pixels);
  return true;
}

bool unpack_rvl(const unsigned char* data, std::size_t size, Message& out) {
  if (size < 8 || !begin_depth(out, little_endian(data), little_endian(data + 4))) return false;
  const auto pixels = static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height);
  auto depth = decode_rvl(data + 8, size - 8, pixels);
  if (!depth) return false;
  out.depth = std::move(*depth);
  return true;
}

}  // namespace

void DepthReader::fill_from_metres(const std::vector<float>& values, Message& out) {
  std::optional<float>& unit = units_[out.topic];
  if (!unit) unit = unit_of(values);
  out.metres = true;
  out.floats_in_mm = unit == 0.001f;
  out.depth.resize(values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    out.depth[i] = to_millimetres(values[i], unit.value_or(1.0f));
}

bool DepthReader::read(const RawImage& in, Message& out) {
  out.encoding = in.encoding;
  if (!begin_depth(out, in.width, in.height)) return false;
  const bool floats = in.encoding == "32FC1";
  if (!floats && in.encoding != "16UC1" && in.encoding != "mono16") return false;
  const std::size_t pixel_bytes = floats ? 4 : 2;
  const std::size_t width = in.width, height = in.height;
  if (in.step < width * pixel_bytes) return false;
  if (in.size < std::size_t{in.step} * (height - 1) + width * pixel_bytes) return false;
  out.kind = Kind::kDepth;
  out.depth.resize(width * height);
  std::vector<float> values(floats ? width * height : 0);
  for (std::size_t v = 0; v < height; ++v) {
    const unsigned char* row = in.data + v * in.step;
    for (std::size_t u = 0; u < width; ++u) {
      unsigned char bytes[4];
      for (std::size_t b = 0; b < pixel_bytes; ++b) {
        bytes[b] = row[u * pixel_bytes + (in.bigendian ? pixel_bytes - 1 - b : b)];
      }
      std::uint16_t& pixel = out.depth[v * width + u];
      if (floats) {
        std::memcpy(&values[v * width + u], bytes, sizeof(float));
      } else {
        std::memcpy(&pixel, bytes, sizeof pixel);
      }
    }
  }
  if (floats) fill_from_metres(values, out);
  return true;
}

bool DepthReader::read(const PackedImage& in, Message& out) {
  const auto has = [&](std::string_view word) { return in.format.find(word) != std::string::npos; };
  out.encoding = in.format;
  const bool packed = has("compressedDepth"), floats = has("32FC1");
  if (!packed && !has("16UC1") && !has("mono16")) return false;
  const std::size_t header = packed ? 12 : 0;  // number of the format, A, B
  if (in.size <= header) return false;
  const unsigned char* body = in.data + header;
  const std::size_t size = in.size - header;
  if (!(has("rvl") ? unpack_rvl(body, size, out) : unpack_png(body, size, out))) return false;
  out.kind = Kind::kDepth;
  if (!packed || !floats) return true;
  const float a = as_float(little_endian(in.data + 4)), b = as_float(little_endian(in.data + 8));
  std::vector<float> values;
  values.reserve(out.depth.size());
  for (const std::uint16_t code : out.depth)
    values.push_back(code == 0 ? std::numeric_limits<float>::quiet_NaN()
                               : a / (static_cast<float>(code) - b));
  fill_from_metres(values, out);
  return true;
}

}  // namespace lamina::bag
