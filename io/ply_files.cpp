// Binary PLY.
#include <lamina/io/ply_files.hpp>

#include <array>
#include <ostream>
#include <string>

#include <lamina/io/atomic_file.hpp>
#include <lamina/io/ply_places.hpp>
#include <lamina/models/ear_clipping.hpp>

namespace lamina::io {

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

namespace {

// Planes as vertices, each outline's own, and triangles between them.
class PlaneMesh {
 public:
  explicit PlaneMesh(const std::vector<MapPlane>& planes) {
    for (const auto& plane : planes) {
      for (const auto& outline : plane.outlines_map) {
        for (const auto& point : outline) places_.see(point);
      }
    }
    for (const auto& plane : planes) {
      const SE3 T_plane_map = plane_frame(plane.plane_map, plane.centroid_map).inverse();
      for (const auto& outline : plane.outlines_map) add(plane, T_plane_map, outline);
    }
  }

  std::string text() const {
    return "ply\nformat binary_little_endian 1.0\ncomment map frame, metres\nelement vertex " +
           std::to_string(vertex_count_) + "\n" + places_.properties() +
           "property float nx\nproperty float ny\nproperty float nz\n"
           "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face " +
           std::to_string(face_count_) +
           "\nproperty list uchar int vertex_indices\nproperty int plane_id\nend_header\n" +
           vertices_ + faces_;
  }

 private:
  void add(const MapPlane& plane, const SE3& T_plane_map,
           const std::vector<Eigen::Vector3d>& outline) {
    const auto color = color_of(plane.label);
    std::vector<Eigen::Vector2d> flat;
    for (const auto& point : outline) {
      flat.push_back((T_plane_map * point).head<2>());
      places_.write(vertices_, point);
      for (int k = 0; k < 3; ++k) put(vertices_, static_cast<float>(plane.plane_map.normal()[k]));
      for (const auto channel : color) put(vertices_, channel);
    }
    for (const auto& triangle : triangles_of(flat)) {
      put(faces_, std::uint8_t{3});
      for (const std::size_t corner : triangle) {
        put(faces_, static_cast<std::int32_t>(vertex_count_ + corner));
      }
      put(faces_, static_cast<std::int32_t>(plane.id));
      ++face_count_;
    }
    vertex_count_ += outline.size();
  }

  PlyPlaces places_;
  std::string vertices_, faces_;
  std::size_t vertex_count_ = 0, face_count_ = 0;
};

}  // namespace

void write_planes_ply(const std::filesystem::path& file, const std::vector<MapPlane>& planes) {
  write_atomically(file, PlaneMesh(planes).text());
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
