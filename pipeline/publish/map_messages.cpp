// Fields in the order of their definitions [ROS2Interfaces].
#include <lamina/pipeline/publish/map_messages.hpp>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <cmath>
#include <map>

#include <lamina/io/ply_files.hpp>
#include <lamina/models/ear_clipping.hpp>
#include <lamina/sensors/ros2/cdr_writer.hpp>

namespace lamina::publish {
namespace {

using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

using bag::kSecond;

enum : std::int8_t { kFree = 0, kOccupied = 100, kUnknown = -1 };  // cells
enum : std::int32_t { kAdd = 0, kTriangles = 11 };                 // of markers
enum : std::uint8_t { kFloat32 = 7 };                              // of points

// One message: written field by field, then taken.
class Writer {
 public:
  Writer() : out_(buffer_, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR) { out_.serialize_encapsulation(); }
  template <class Value>
  Writer& operator<<(const Value& value) {
    out_ << value;
    return *this;
  }
  Writer& operator<<(Timestamp stamp) {
    std::int64_t seconds = stamp.nanoseconds() / kSecond, rest = stamp.nanoseconds() % kSecond;
    if (rest < 0) seconds -= 1, rest += kSecond;
    return *this << static_cast<std::int32_t>(seconds) << static_cast<std::uint32_t>(rest);
  }
  Writer& operator<<(const Header& header) { return *this << header.stamp << header.frame; }
  Writer& operator<<(const Eigen::Vector3d& p) { return *this << p.x() << p.y() << p.z(); }
  Writer& operator<<(const SE3& pose) {
    const Eigen::Quaterniond q = pose.so3().quaternion();
    return *this << Eigen::Vector3d(pose.translation()) << q.x() << q.y() << q.z() << q.w();
  }
  Writer& length(std::size_t count) { return *this << static_cast<std::uint32_t>(count); }
  std::string taken() { return {buffer_.getBuffer(), out_.getSerializedDataLength()}; }

 private:
  FastBuffer buffer_;
  Cdr out_;
};

using Color = std::array<std::uint8_t, 3>;

struct Marker {
  std::string space;
  Color color{};
  std::vector<Eigen::Vector3d> corners;  // three a triangle
  float opacity = 0.8F;
};

void put(Writer& out, const Marker& marker, const Header& header) {
  out << header << marker.space << std::int32_t{0} << std::int32_t{kTriangles} << std::int32_t{kAdd}
      << SE3() << Eigen::Vector3d(1, 1, 1);
  for (const std::uint8_t part : marker.color) out << static_cast<float>(part) / 255;
  out << marker.opacity << std::int32_t{0} << std::uint32_t{0}
      << false;  // lifetime for ever, not locked
  out.length(marker.corners.size());
  for (const Eigen::Vector3d& corner : marker.corners) out << corner;
  out.length(0);                                           // colours of corners
  out << std::string() << Header{} << std::string();       // texture
  out.length(0).length(0);                                 // its data, coordinates
  out << std::string() << std::string() << std::string();  // text, mesh, its file
  out.length(0) << false;                                  // the file's data
}

std::string markers(const std::vector<Marker>& all, const Header& header) {
  Writer out;
  out.length(all.size());
  for (const Marker& marker : all) put(out, marker, header);
  return out.taken();
}

void add_triangles(const MapPlane& plane, std::vector<Eigen::Vector3d>& corners) {
  const Matrix32d basis = plane.plane_map.tangent_basis();
  for (const auto& outline : plane.outlines_map) {
    std::vector<Eigen::Vector2d> flat;
    for (const Eigen::Vector3d& p : outline)
      flat.emplace_back(basis.transpose() * (p - plane.centroid_map));
    for (const auto& triangle : triangles_of(flat))
      for (const std::size_t corner : triangle) corners.push_back(outline[corner]);
  }
}

}  // namespace

GridCells cells_of(const OccupancyGrid& grid) {
  const GridGeometry g = grid.bounds();
  GridCells all;
  all.resolution = g.resolution;
  if (g.empty()) return all;
  all.x = g.resolution * g.first.i;
  all.y = g.resolution * g.first.j;
  all.width = static_cast<std::uint32_t>(g.width);
  all.height = static_cast<std::uint32_t>(g.height);
  std::vector<float> row(all.width);
  for (int y = g.height - 1; y >= 0; --y) {
    grid.image_row(g, y, row.data());
    for (const float p : row) {
      all.cells.push_back(p > 0.65F ? kOccupied : p < 0.196F ? kFree : kUnknown);
    }
  }
  return all;
}

CellRange changed_cells(const GridCells& before, const GridCells& after) {
  std::uint32_t x0 = after.width, x1 = 0, y0 = after.height, y1 = 0;
  for (std::uint32_t y = 0; y < after.height; ++y) {
    for (std::uint32_t x = 0; x < after.width; ++x) {
      const std::size_t k = std::size_t{y} * after.width + x;
      if (before.cells[k] == after.cells[k]) continue;
      x0 = std::min(x0, x);
      x1 = std::max(x1, x + 1);
      y0 = std::min(y0, y);
      y1 = std::max(y1, y + 1);
    }
  }
  return x1 > x0 ? CellRange{x0, y0, x1 - x0, y1 - y0} : CellRange{};
}

std::string grid_message(const GridCells& grid, const Header& header) {
  Writer out;
  out << header << header.stamp << static_cast<float>(grid.resolution) << grid.width << grid.height
      << SE3(SO3(), {grid.x, grid.y, 0});
  out << grid.cells;
  return out.taken();
}

std::string grid_update_message(const GridCells& grid, const CellRange& range,
                                const Header& header) {
  std::vector<std::int8_t> cells;
  for (std::uint32_t y = range.y; y < range.y + range.height; ++y) {
    const auto row = grid.cells.begin() + static_cast<std::ptrdiff_t>(std::size_t{y} * grid.width);
    cells.insert(cells.end(), row + range.x, row + range.x + range.width);
  }
  Writer out;
  out << header << static_cast<std::int32_t>(range.x) << static_cast<std::int32_t>(range.y)
      << range.width << range.height << cells;
  return out.taken();
}

std::string path_message(const Trajectory& path, const Header& header) {
  Writer out;
  out << header;
  out.length(path.size());
  for (const StampedPose& p : path) out << Header{p.stamp, header.frame} << p.pose;
  return out.taken();
}

std::string planes_message(const std::vector<MapPlane>& planes, const Header& header) {
  std::map<PlaneLabel, Marker> by_label;  // all of them: a label that went leaves an empty marker
  for (const PlaneLabel label : {PlaneLabel::kFloor, PlaneLabel::kRamp, PlaneLabel::kStep,
                                 PlaneLabel::kWall, PlaneLabel::kCeiling, PlaneLabel::kOther})
    by_label[label] = {to_string(label), io::color_of(label), {}};
  for (const MapPlane& plane : planes) add_triangles(plane, by_label[plane.label].corners);
  std::vector<Marker> all;
  for (auto& [label, marker] : by_label) all.push_back(std::move(marker));
  return markers(all, header);
}

std::string surfels_message(const std::vector<Surfel>& surfels, const Header& header) {
  Marker marker{"surfels", io::color_of(PlaneLabel::kFloor), {}};
  for (const Surfel& surfel : surfels) {
    const Matrix32d basis = Plane::tangent_basis(surfel.normal);
    const auto corner = [&](double a, double b) -> Eigen::Vector3d {
      return surfel.center + surfel.radius * (basis * Eigen::Vector2d(a, b));
    };
    for (const auto& p :
         {corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, -1), corner(1, 1), corner(-1, 1)})
      marker.corners.push_back(p);
  }
  return markers({marker}, header);
}

std::string edges_message(const std::vector<EdgePoint>& edges, const Header& header) {
  const std::uint32_t number = sizeof(float), point = 3 * number;  // bytes
  std::vector<float> numbers;
  for (const EdgePoint& edge : edges) {
    if (!edge.negative) continue;
    for (const double value : edge.position_map) numbers.push_back(static_cast<float>(value));
  }
  const auto bytes = static_cast<std::uint32_t>(number * numbers.size());
  Writer out;
  out << header << std::uint32_t{1} << bytes / point;
  out.length(3);
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z"}) {
    out << std::string(name) << offset << std::uint8_t{kFloat32} << std::uint32_t{1};
    offset += number;
  }
  const void* data = numbers.data();
  const auto* begin = static_cast<const std::uint8_t*>(data);
  out << false << point << bytes << std::vector<std::uint8_t>(begin, begin + bytes) << true;
  return out.taken();
}

std::string scan_message(const LaserScan& scan, const std::string& frame) {
  bag::Message message;
  message.kind = bag::Kind::kScan;
  message.frame = frame;
  message.stamp_ns = scan.stamp.nanoseconds();
  message.angle_min = static_cast<float>(scan.angle_min);
  message.angle_increment = static_cast<float>(scan.angle_increment);
  message.range_min = static_cast<float>(scan.range_min);
  message.range_max = static_cast<float>(scan.range_max);
  message.ranges = scan.ranges;
  return ros2::encode(message).bytes;
}

std::string transform_message(const SE3& T, const std::string& child, const Header& header) {
  Writer out;
  out.length(1) << header << child << T;
  return out.taken();
}

}  // namespace lamina::publish
