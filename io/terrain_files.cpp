// The height layer as a mesh.
#include <lamina/io/terrain_files.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ostream>
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

struct PlyFaces {
  std::string bytes;
  std::size_t count = 0;

  // Of vertices numbered from 1.
  void add(std::int32_t a, std::int32_t b, std::int32_t c) {
    put(bytes, std::uint8_t{3});
    for (const std::int32_t corner : {a, b, c}) put(bytes, corner - 1);
    ++count;
  }
};

// Two triangles wherever four neighbouring cells have a vertex each; 0: none.
PlyFaces triangulated(const TiledGrid<std::int32_t>& number) {
  PlyFaces faces;
  auto at = [look = TiledGrid<std::int32_t>::Look(number)](std::int32_t i, std::int32_t j) mutable {
    const std::int32_t* n = look.find({i, j});
    return n == nullptr ? 0 : *n;
  };
  number.for_each([&](const CellIndex& c, std::int32_t a) {
    if (a == 0) return;
    const std::int32_t right = at(c.i + 1, c.j), above = at(c.i, c.j + 1);
    const std::int32_t across = at(c.i + 1, c.j + 1);
    if (right == 0 || above == 0 || across == 0) return;
    faces.add(a, right, across);
    faces.add(a, across, above);
  });
  return faces;
}

}  // namespace

void write_terrain_ply(const std::filesystem::path& file, const NavigabilityGrid& grid) {
  TiledGrid<std::int32_t> number(grid.resolution());  // of vertices, from 1
  std::string vertices;
  const auto place = [&grid](const CellIndex& c, const NavigabilityCell& cell) {
    const Eigen::Vector2d p = center_of(c, grid.resolution());
    return Eigen::Vector3d(p.x(), p.y(), static_cast<double>(cell.height));
  };
  PlyPlaces places;
  grid.for_each([&](const CellIndex& c, const NavigabilityCell& cell) {
    if (std::isfinite(cell.height)) places.see(place(c, cell));
  });
  std::int32_t known = 0;
  grid.for_each([&](const CellIndex& c, const NavigabilityCell& cell) {
    if (!std::isfinite(cell.height)) return;
    number.at_or_new(c) = ++known;
    places.write(vertices, place(c, cell));
    put_colour(vertices, cell.navigability);
  });
  const PlyFaces faces = triangulated(number);
  write_atomically(file, [&](std::ostream& out) {
    out << "ply\nformat binary_little_endian 1.0\ncomment map frame, metres\nelement vertex "
        << known << "\n"
        << places.properties()
        << "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face "
        << faces.count << "\nproperty list uchar int vertex_indices\nend_header\n"
        << vertices << faces.bytes;
  });
}

}  // namespace lamina::io
