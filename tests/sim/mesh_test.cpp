// Meshes: files, and Embree against the analytic caster.
#include <lamina/sim/mesh_file.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include <lamina/models/error.hpp>
#include <lamina/sim/depth_camera.hpp>
#include <lamina/sim/world.hpp>

namespace lamina::sim {
namespace {

const char* const kAscii =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\n"
    "property float y\nproperty float z\nproperty uchar red\nelement face 1\n"
    "property list uchar int vertex_indices\nend_header\n"
    "0 0 0 7\n1 0 0 7\n1 1 0 7\n0 1 0.5 7\n4 0 1 2 3\n";

std::string message_of(const std::string& bytes) {
  try {
    parse_ply(bytes, "x.ply");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(MeshFile, AsciiPlyWithAQuad) {
  const Mesh mesh = parse_ply(kAscii, "x.ply");
  ASSERT_EQ(mesh.vertices_map.size(), 4u);
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.vertices_map[3], Eigen::Vector3f(0, 1, 0.5F));
  EXPECT_EQ(mesh.triangles[1], Eigen::Vector3i(0, 2, 3));
}

TEST(MeshFile, BinaryPlyInBothByteOrders) {
  for (const bool big : {false, true}) {
    std::string bytes = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                        "_endian 1.0\nelement vertex 3\nproperty double x\nproperty float y\n"
                        "property float z\nelement face 1\n"
                        "property list uchar uint vertex_index\nend_header\n";
    const auto put = [&](auto value) {
      char raw[sizeof value];
      std::memcpy(raw, &value, sizeof value);
      if (big) std::reverse(raw, raw + sizeof value);
      bytes.append(raw, sizeof value);
    };
    for (int i = 0; i < 3; ++i) {
      put(1.0 * i), put(2.0F * static_cast<float>(i)), put(3.0F);
    }
    put(std::uint8_t{3}), put(2U), put(1U), put(0U);
    const Mesh mesh = parse_ply(bytes, "x.ply");
    ASSERT_EQ(mesh.vertices_map.size(), 3u);
    EXPECT_EQ(mesh.vertices_map[2], Eigen::Vector3f(2, 4, 3));
    ASSERT_EQ(mesh.triangles.size(), 1u);
    EXPECT_EQ(mesh.triangles[0], Eigen::Vector3i(2, 1, 0));
    EXPECT_THROW(parse_ply(bytes.substr(0, bytes.size() - 2), "x.ply"), Error);
  }
}

TEST(MeshFile, ObjWithTexturedAndNegativeIndices) {
  const Mesh mesh =
      parse_obj("# cube\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nf 1/1/1 2/1 3\nf -3 -2 -1\n", "x.obj");
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.triangles[0], Eigen::Vector3i(0, 1, 2));
  EXPECT_EQ(mesh.triangles[1], Eigen::Vector3i(0, 1, 2));
}

TEST(MeshFile, EntriesThatTakeNoBytesAreRefused) {
  EXPECT_THROW(parse_ply("ply\nformat ascii 1.0\nelement vertex 3\nend_header\n", "x.ply"), Error);
  EXPECT_NO_THROW(parse_ply("ply\nformat ascii 1.0\nelement vertex 0\nend_header\n", "x.ply"));
}

TEST(MeshFile, ErrorsNameThePlace) {
  EXPECT_EQ(message_of("plx\n"), "x.ply:1: found \"plx\", expected ply");
  std::string bytes = kAscii;
  bytes.replace(bytes.rfind("4 0 1 2 3"), 9, "4 0 1 2 9");
  EXPECT_THAT(message_of(bytes), ::testing::HasSubstr("vertex 9"));
  EXPECT_THAT(message_of(std::string(kAscii, std::strlen(kAscii) - 6)),
              ::testing::HasSubstr("end of the file"));
  EXPECT_THROW(parse_obj("v 0 0\n", "x.obj"), Error);
  // Found by fuzz_mesh: an index beyond any integer.
  EXPECT_THROW(parse_ply("ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int "
                         "vertex_indices\nend_header\n3 0 1 1e86\n",
                         "x.ply"),
               Error);
  EXPECT_THROW(parse_obj("v 0 0 0\nf 1 1 2\n", "x.obj"), Error);
  EXPECT_THROW(read_mesh("/nowhere/x.ply"), Error);
}

Scene random_boxes(std::uint64_t seed) {
  Random random(seed, 0);
  Scene scene;
  scene.add_ground("floor", PlaneLabel::kFloor, {-6, -6, 6, 6}, 0);
  for (int i = 0; i < 15; ++i) {
    const SO3 R = SO3::exp({random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-3, 3)});
    scene.add_box("box" + std::to_string(i),
                  SE3(R, {random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(0, 2)}),
                  {random.uniform(0.1, 1.5), random.uniform(0.1, 1.5), random.uniform(0.1, 1.5)});
  }
  return scene;
}

TEST(MeshCaster, AgreesWithTheAnalyticCasterToATenthOfAMillimetre) {
  int rays = 0, differ = 0;
  double worst = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Scene scene = random_boxes(seed);
    Scene meshed;
    meshed.add_mesh(triangulate(scene));
    const Caster analytic(scene), embree(meshed);
    Random random(seed, 1);
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector3d origin(random.uniform(-5, 5), random.uniform(-5, 5),
                                   random.uniform(0.1, 4));
      const Eigen::Vector3d direction =
          Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
      const auto a = analytic.cast(origin, direction, 1e-3),
                 b = embree.cast(origin, direction, 1e-3);
      ++rays;
      if (a.has_value() != b.has_value() || (a && std::abs(a->range - b->range) > 1e-4)) {
        ++differ;  // a ray that grazes an edge may take either side of it in single precision
      } else if (a) {
        worst = std::max(worst, std::abs(a->range - b->range));
      }
    }
  }
  EXPECT_LT(worst, 1e-4);
  EXPECT_LE(differ, rays / 2000) << "of " << rays;
}

TEST(MeshCaster, MeshAndPlanesShareOneImage) {
  Scene scene;
  scene.add_ground("floor", PlaneLabel::kFloor, {-10, -10, 10, 10}, 0);
  Scene box;
  box.add_box("box", SE3::planar(2, 0, 0.3), {0.6, 0.6, 0.5});
  Scene mixed = scene;
  mixed.add_mesh(triangulate(box));
  scene.add_box("box", SE3::planar(2, 0, 0.3), {0.6, 0.6, 0.5});
  const Caster planar(scene), meshed(mixed);
  DepthCamera camera = kinect_camera(mount_camera({0, 0, 0.8}, 0, 0.4, 0));
  camera.camera.width = 160, camera.camera.height = 120;
  camera.camera.fx = camera.camera.fy = 131, camera.camera.cx = 79.5, camera.camera.cy = 59.5;
  const SE3 T_map_camera = camera.camera.T_body_camera;
  const DepthTruth a = DepthRenderer(planar, camera, DepthEffects::none(), 1).truth(T_map_camera);
  const DepthTruth b = DepthRenderer(meshed, camera, DepthEffects::none(), 1).truth(T_map_camera);
  int differ = 0, on_mesh = 0;
  for (std::size_t i = 0; i < a.inverse_depth.size(); ++i) {
    differ += std::abs(a.inverse_depth[i] - b.inverse_depth[i]) > 1e-4F ? 1 : 0;
    on_mesh += b.surface[i] == 1 ? 1 : 0;
  }
  EXPECT_GT(on_mesh, 500);
  EXPECT_LE(differ, 3);
}

}  // namespace
}  // namespace lamina::sim
