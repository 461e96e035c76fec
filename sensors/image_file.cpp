// Reads image files.
#include <lamina/sensors/image_file.hpp>

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
}  // namespace

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
