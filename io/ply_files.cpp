// Binary PLY.
#include <lamina/io/ply_files.hpp>

#include <array>
#include <ostream>
#include <string>

#include <lamina/io/atomic_file.hpp>
#include <lamina/io/ply_places.hpp>

namespace lamina::io {
namespace {

// Okabe-Ito colours, which colour-blind readers tell apart.
std::array<std::uint8_t, 3> color_of(PlaneLabel label) {
  switch (label) {
    case PlaneLabel::kFloor:
      return {0, 158, 115};
    case PlaneLabel::kRamp:
      return {240, 228, 66};
    case PlaneLabel::kStep:
      return {230, 159, 0};
    case PlaneLabel::kWall:
      return {86, 180, 233};
    case PlaneLabel::kCeiling:
      return {204, 121, 167};
    case PlaneLabel::kOther:
      break;
  }
  return {153, 153, 153};
}

}  // namespace

void write_planes_ply(const std::filesystem::path& file, const std::vector<MapPlane>& planes) {
  std::string vertices, faces;
  std::size_t vertex_count = 0, face_count = 0;
  PlyPlaces places;
  for (const auto& plane : planes) {
    for (const auto& outline : plane.outlines_map) {
      for (const auto& point : outline) places.see(point);
    }
  }
  for (const auto& plane : planes) {
    const auto color = color_of(plane.label);
    for (const auto& outline : plane.outlines_map) {
      if (outline.size() < 3) continue;
      put(faces, static_cast<std::int32_t>(outline.size()));
      for (const auto& point : outline) {
        places.write(vertices, point);
        for (const auto channel : color) put(vertices, channel);
        put(faces, static_cast<std::int32_t>(vertex_count++));
      }
      put(faces, static_cast<std::int32_t>(plane.id));
      ++face_count;
    }
  }
  const std::string header =
      "ply\nformat binary_little_endian 1.0\ncomment map frame, metres\nelement vertex " +
      std::to_string(vertex_count) + "\n" + places.properties() +
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face " +
      std::to_string(face_count) +
      "\nproperty list int int vertex_indices\nproperty int plane_id\nend_header\n";
  write_atomically(file, header + vertices + faces);
}

void write_surfels_ply(const std::filesystem::path& file, const std::vector<Surfel>& surfels) {
  std::string body;
  PlyPlaces places;
  for (const auto& surfel : surfels) places.see(surfel.center);
  for (const auto& surfel : surfels) {
    places.write(body, surfel.center);
    for (int k = 0; k < 3; ++k) put(body, static_cast<float>(surfel.normal[k]));
    put(body, static_cast<float>(surfel.radius));
    put(body, static_cast<float>(surfel.sigma_height()));
  }
  const std::string header =
      "ply\nformat binary_little_endian 1.0\ncomment map frame, metres\nelement vertex " +
      std::to_string(surfels.size()) + "\n" + places.properties() +
      "property float nx\nproperty float ny\nproperty float nz\nproperty float radius\n"
      "property float sigma_height\nend_header\n";
  write_atomically(file, header + body);
}

}  // namespace lamina::io
