// The height layer as a mesh.
#include <lamina/io/terrain_files.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include <lamina/io/atomic_file.hpp>
#include <lamina/io/ply_places.hpp>

namespace lamina::io {
namespace {

void put_colour(std::string& out, float navigability) {
  const auto byte = [](float share) {
    return static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(share, 0.0F, 1.0F)));
  };
  const bool known = navigability == navigability;
  put(out, known ? byte(2 - 2 * navigability) : std::uint8_t{128});
  put(out, known ? byte(2 * navigability) : std::uint8_t{128});
  put(out, known ? std::uint8_t{0} : std::uint8_t{128});
}

}  // namespace

void write_terrain_ply(const std::filesystem::path& file, const NavigabilityGrid& grid) {
  std::map<CellIndex, std::int32_t> number;
  std::string vertices, faces;
  const auto place = [&grid](const CellIndex& c, const NavigabilityCell& cell) {
    const Eigen::Vector2d p = center_of(c, grid.resolution());
    return Eigen::Vector3d(p.x(), p.y(), static_cast<double>(cell.height));
  };
  PlyPlaces places;
  grid.for_each([&](const CellIndex& c, const NavigabilityCell& cell) {
    if (std::isfinite(cell.height)) places.see(place(c, cell));
  });
  grid.for_each([&](const CellIndex& c, const NavigabilityCell& cell) {
    if (!std::isfinite(cell.height)) return;
    number.emplace(c, static_cast<std::int32_t>(number.size()));
    places.write(vertices, place(c, cell));
    put_colour(vertices, cell.navigability);
  });
  std::size_t count = 0;
  const auto face = [&](std::int32_t a, std::int32_t b, std::int32_t c) {
    put(faces, std::uint8_t{3});
    put(faces, a), put(faces, b), put(faces, c);
    ++count;
  };
  for (const auto& [c, a] : number) {
    const auto right = number.find({c.i + 1, c.j}), above = number.find({c.i, c.j + 1});
    const auto across = number.find({c.i + 1, c.j + 1});
    if (right == number.end() || above == number.end() || across == number.end()) continue;
    face(a, right->second, across->second);
    face(a, across->second, above->second);
  }
  const std::string header =
      "ply\nformat binary_little_endian 1.0\ncomment map frame, metres\nelement vertex " +
      std::to_string(number.size()) + "\n" + places.properties() +
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face " +
      std::to_string(count) + "\nproperty list uchar int vertex_indices\nend_header\n";
  write_atomically(file, header + vertices + faces);
}

}  // namespace lamina::io
