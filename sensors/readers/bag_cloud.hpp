// sensor_msgs/PointCloud2: points of a depth camera or of a scanner with several rings.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <lamina/sensors/readers/bag_messages.hpp>

namespace lamina::bag {

/// sensor_msgs/PointCloud2 as it lies in a message.
struct RawCloud {
  struct Field {
    std::string name;
    std::uint32_t offset = 0, count = 1;
    std::uint8_t datatype = 0;  ///< 7: float32, 8: float64
  };
  std::uint32_t width = 0, height = 0, point_step = 0, row_step = 0;  ///< points, bytes
  std::vector<Field> fields;
  bool bigendian = false;
  const unsigned char* data = nullptr;
  std::size_t size = 0;  ///< bytes
};

/// Fills size and points of `out`. False when x, y or z is missing or no floating-point number, or
/// sizes and bytes do not agree.
bool read_cloud(const RawCloud& in, Message& out);

}  // namespace lamina::bag
