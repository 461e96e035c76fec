// Fields by name and type.
#include <lamina/sensors/readers/bag_cloud.hpp>

#include <cstring>

namespace lamina::bag {
namespace {
enum : std::uint8_t { kFloat32 = 7, kFloat64 = 8 };

template <class Number>
float number_at(const unsigned char* bytes, bool bigendian) {
  unsigned char ordered[sizeof(Number)];
  for (std::size_t b = 0; b < sizeof(Number); ++b)
    ordered[b] = bytes[bigendian ? sizeof(Number) - 1 - b : b];
  Number value;
  std::memcpy(&value, ordered, sizeof value);
  return static_cast<float>(value);
}

const RawCloud::Field* coordinate(const RawCloud& in, const char* name) {
  for (const auto& field : in.fields) {
    if (field.name != name) continue;
    const std::uint32_t bytes = field.datatype == kFloat32 ? 4 : field.datatype == kFloat64 ? 8 : 0;
    if (bytes == 0 || std::uint64_t{field.offset} + bytes > in.point_step) return nullptr;
    return &field;
  }
  return nullptr;
}

}  // namespace

bool read_cloud(const RawCloud& in, Message& out) {
  const RawCloud::Field* fields[] = {coordinate(in, "x"), coordinate(in, "y"), coordinate(in, "z")};
  for (const auto* field : fields)
    if (!field) return false;
  const std::uint64_t row = std::uint64_t{in.width} * in.point_step;
  if (in.width == 0 || in.height == 0 || in.width > (1u << 28) || in.height > (1u << 28))
    return false;
  const std::uint64_t stride = in.height > 1 ? in.row_step : row;
  // Dividing keeps a claimed height from running over.
  if (stride < row || in.size < row || (in.size - row) / stride < in.height - 1) return false;
  out.kind = Kind::kCloud;
  out.width = static_cast<int>(in.width);
  out.height = static_cast<int>(in.height);
  out.points.reserve(std::size_t{in.width} * in.height);
  for (std::size_t v = 0; v < in.height; ++v) {
    for (std::size_t u = 0; u < in.width; ++u) {
      const unsigned char* point = in.data + v * stride + u * in.point_step;
      auto& xyz = out.points.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const unsigned char* bytes = point + fields[k]->offset;
        xyz[k] = fields[k]->datatype == kFloat32 ? number_at<float>(bytes, in.bigendian)
                                                 : number_at<double>(bytes, in.bigendian);
      }
    }
  }
  return true;
}

}  // namespace lamina::bag
