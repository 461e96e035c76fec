// Depth images of bags: raw, or packed as image_transport packs them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include <lamina/sensors/readers/bag_messages.hpp>

namespace lamina::bag {

/// sensor_msgs/Image as it lies in a message.
struct RawImage {
  std::uint32_t width = 0, height = 0, step = 0;  ///< px, px, bytes a row
  std::string encoding;
  bool bigendian = false;
  const unsigned char* data = nullptr;
  std::size_t size = 0;  ///< bytes
};

/// sensor_msgs/CompressedImage as it lies in a message.
struct PackedImage {
  std::string format;  ///< "16UC1; compressedDepth png", "32FC1; compressedDepth rvl", ...
  const unsigned char* data = nullptr;
  std::size_t size = 0;  ///< bytes
};

/// Turns images to millimetres. Remembers of each topic of floats whether they are metres.
class DepthReader {
 public:
  /// Fills size, encoding and depth of `out`; `out.topic` is the image's. False when it is no depth
  /// image, or its size and its bytes do not agree.
  bool read(const RawImage& in, Message& out);
  /// Likewise of 16-bit PNG and RVL [Wilson2017] after compressedDepth's header of 12 bytes: a
  /// number of its format and A and B, by which floats were packed as A / depth + B. 16-bit PNG
  /// without that header, too.
  bool read(const PackedImage& in, Message& out);

 private:
  void fill_from_metres(const std::vector<float>& values, Message& out);

  std::map<std::string, std::optional<float>> units_;  ///< of topics of 32FC1, m; none: unknown yet
};

}  // namespace lamina::bag
