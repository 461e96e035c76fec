// planes.ply is triangles that mesh viewers load whole, concave outlines and all.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <lamina/io/ply_files.hpp>

namespace lamina::io {
namespace {

struct Vertex {
  float place[3], normal[3];
  std::uint8_t color[3];
};
struct Face {
  std::int32_t corner[3], plane_id;
};

template <class T>
T take(const char*& at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  at += sizeof value;
  return value;
}

struct Mesh {
  std::string header;
  std::vector<Vertex> vertices;
  std::vector<Face> faces;

  double area(std::int32_t id) const {
    double sum = 0;
    for (const Face& face : faces) {
      if (face.plane_id != id) continue;
      Eigen::Vector3d p[3];
      for (int k = 0; k < 3; ++k) {
        const float* place = vertices.at(static_cast<std::size_t>(face.corner[k])).place;
        p[k] = {place[0], place[1], place[2]};
      }
      sum += 0.5 * (p[1] - p[0]).cross(p[2] - p[0]).norm();
    }
    return sum;
  }
};

std::size_t count_of(const std::string& header, const std::string& element) {
  const std::size_t at = header.find("element " + element + " ");
  return std::stoul(header.substr(at + 9 + element.size()));
}

Mesh read_mesh(const std::filesystem::path& file) {
  std::stringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  const std::string all = text.str();
  const std::size_t body = all.find("end_header\n") + 11;
  Mesh mesh;
  mesh.header = all.substr(0, body);
  const char* at = all.data() + body;
  for (std::size_t i = count_of(mesh.header, "vertex"); i > 0; --i) {
    Vertex& v = mesh.vertices.emplace_back();
    for (float& x : v.place) x = take<float>(at);
    for (float& x : v.normal) x = take<float>(at);
    for (std::uint8_t& x : v.color) x = take<std::uint8_t>(at);
  }
  for (std::size_t i = count_of(mesh.header, "face"); i > 0; --i) {
    EXPECT_EQ(take<std::uint8_t>(at), 3);
    Face& face = mesh.faces.emplace_back();
    for (std::int32_t& x : face.corner) x = take<std::int32_t>(at);
    face.plane_id = take<std::int32_t>(at);
  }
  EXPECT_EQ(at, all.data() + all.size());
  return mesh;
}

MapPlane floor_with(std::vector<std::vector<Eigen::Vector3d>> outlines) {
  MapPlane plane;
  plane.id = 7;
  plane.label = PlaneLabel::kFloor;
  plane.plane_map = *Plane::from_normal_rho(Eigen::Vector3d::UnitZ(), 1);
  plane.centroid_map = {0, 0, 1};
  plane.outlines_map = std::move(outlines);
  return plane;
}

TEST(PlanesPly, ConcaveOutlinesAreTrianglesOfTheirPlane) {
  const auto file = std::filesystem::temp_directory_path() / "lamina_planes_test.ply";
  MapPlane wall;
  wall.id = 9;
  wall.label = PlaneLabel::kWall;
  wall.plane_map = *Plane::from_normal_rho(-Eigen::Vector3d::UnitX(), -2);
  wall.centroid_map = {2, 0, 1};
  wall.outlines_map = {{{2, 0, 0}, {2, 3, 0}, {2, 3, 2}, {2, 0, 2}}};
  // An L, and a piece beside it.
  write_planes_ply(file,
                   {floor_with({{{0, 0, 1}, {2, 0, 1}, {2, 1, 1}, {1, 1, 1}, {1, 2, 1}, {0, 2, 1}},
                                {{5, 5, 1}, {6, 5, 1}, {6, 6, 1}}}),
                    wall});
  const Mesh mesh = read_mesh(file);
  std::filesystem::remove(file);
  EXPECT_NE(mesh.header.find("property list uchar int vertex_indices\n"), std::string::npos);
  ASSERT_EQ(mesh.vertices.size(), 13U);
  ASSERT_EQ(mesh.faces.size(), 4U + 1U + 2U);
  EXPECT_NEAR(mesh.area(7), 3.5, 1e-6);
  EXPECT_NEAR(mesh.area(9), 6, 1e-6);
  EXPECT_EQ(mesh.vertices.front().normal[2], 1);
  EXPECT_EQ(mesh.vertices.back().normal[0], -1);
  EXPECT_EQ(mesh.vertices.front().color[0], 0);
  EXPECT_EQ(mesh.vertices.back().color[0], 86);
}

// Outlines as maps may hold them: every file is read whole, with indices and areas that are right.
TEST(PlanesPly, DegenerateOutlinesAreStillLoaded) {
  const auto file = std::filesystem::temp_directory_path() / "lamina_planes_degenerate_test.ply";
  struct Case {
    const char* what;
    std::vector<Eigen::Vector3d> outline;
    double area;
  };
  const std::vector<Case> cases{
      {"nothing", {}, 0},
      {"a point", {{1, 1, 1}}, 0},
      {"one point, often", {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, 0},
      {"a line", {{0, 0, 1}, {1, 0, 1}, {2, 0, 1}, {3, 0, 1}}, 0},
      {"points on an edge, and twice",
       {{0, 0, 1}, {1, 0, 1}, {1, 0, 1}, {2, 0, 1}, {2, 2, 1}, {0, 2, 1}, {0, 1, 1}, {0, 0, 1}},
       4},
      {"two squares that touch in a corner",
       {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {2, 1, 1}, {2, 2, 1}, {1, 2, 1}, {1, 1, 1}, {0, 1, 1}},
       2},
      {"a spike without area",
       {{0, 0, 1}, {2, 0, 1}, {2, 2, 1}, {2, 5, 1}, {2, 2, 1}, {0, 2, 1}},
       4},
      {"a hole, cut open to the outside",
       {{0, 0, 1},
        {4, 0, 1},
        {4, 4, 1},
        {0, 4, 1},
        {0, 0, 1},
        {1, 1, 1},
        {1, 3, 1},
        {3, 3, 1},
        {3, 1, 1},
        {1, 1, 1}},
       12},
  };
  for (const Case& c : cases) {
    write_planes_ply(file, {floor_with({c.outline})});
    const Mesh mesh = read_mesh(file);
    std::filesystem::remove(file);
    for (const Face& face : mesh.faces) {
      for (const std::int32_t k : face.corner)
        EXPECT_LT(static_cast<std::size_t>(k), mesh.vertices.size()) << c.what;
    }
    EXPECT_NEAR(mesh.area(7), c.area, 1e-6) << c.what;
  }
}

}  // namespace
}  // namespace lamina::io
