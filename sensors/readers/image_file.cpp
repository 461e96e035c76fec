// Reads image files.
#include <lamina/sensors/readers/image_file.hpp>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <lamina/models/error.hpp>
#include <lamina/sensors/skip_counts.hpp>
#include <lamina/sensors/text.hpp>

namespace lamina {
namespace {
std::optional<std::string> bytes_of(const std::filesystem::path& file, std::string& why) {
  try {
    return read_file_bytes(file);
  } catch (const Error&) {
    why = kSkipMissingFile;
    return std::nullopt;
  }
}

struct PngHeader {
  std::uint32_t width = 0, height = 0, bits = 0;
  bool grey = true;
};

std::optional<PngHeader> png_header(const std::filesystem::path& file) {
  constexpr std::size_t kHeader = 26;  // signature, IHDR up to colour type
  std::string bytes(kHeader, '\0');
  std::ifstream in(file, std::ios::binary);
  if (!in.read(bytes.data(), kHeader) || !is_png(bytes)) return std::nullopt;
  const auto at = [&bytes](std::size_t i) {
    return static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[i]));
  };
  const auto number = [&at](std::size_t i) {
    return at(i) << 24 | at(i + 1) << 16 | at(i + 2) << 8 | at(i + 3);
  };
  return PngHeader{number(16), number(20), at(24), at(25) == 0};
}
}  // namespace

std::string image_facts(const std::filesystem::path& file) {
  const auto header = png_header(file);
  if (!header) return "no PNG";
  return std::to_string(header->width) + " x " + std::to_string(header->height) + ", " +
         std::to_string(header->bits) + " bit " + (header->grey ? "grey" : "colour");
}

std::optional<std::pair<int, int>> image_size(const std::filesystem::path& file) {
  constexpr std::uint32_t kLargest = 1 << 14;
  const auto header = png_header(file);
  if (!header || header->width == 0 || header->height == 0 ||
      std::max(header->width, header->height) > kLargest) {
    return std::nullopt;
  }
  return std::pair(static_cast<int>(header->width), static_cast<int>(header->height));
}

std::optional<DepthImage> read_depth_image(const std::filesystem::path& file, int width, int height,
                                           std::string& why) {
  const auto bytes = bytes_of(file, why);
  if (!bytes) return std::nullopt;
  return decode_png_depth(*bytes, width, height, why);
}

std::optional<GreyImage> read_grey_image(const std::filesystem::path& file, int width, int height,
                                         std::string& why) {
  const auto bytes = bytes_of(file, why);
  if (!bytes) return std::nullopt;
  if (is_png(*bytes)) return decode_png_grey(*bytes, width, height, why);
  try {
    const void* start = bytes->data();
    const cv::Mat data(1, static_cast<int>(bytes->size()), CV_8U, const_cast<void*>(start));
    const cv::Mat image = bytes->empty() ? cv::Mat() : cv::imdecode(data, cv::IMREAD_GRAYSCALE);
    if (image.empty() || image.cols != width || image.rows != height) {
      why = image.empty() ? kSkipBadImage : kSkipWrongSize;
      return std::nullopt;
    }
    GreyImage result{width, height, {}};
    result.pixels.assign(image.data, image.data + image.total());
    return result;
  } catch (const cv::Exception&) {
    why = kSkipBadImage;
    return std::nullopt;
  }
}

}  // namespace lamina
