// Casters against each other and against numbers found by hand.
#include <lamina/sim/caster.hpp>

#include <gtest/gtest.h>

#include <cmath>

#include <lamina/sim/sim_recording.hpp>
#include <lamina/sim/world.hpp>

namespace lamina::sim {
namespace {

/// Boxes, a ramp, posts and a floor with a hole, placed by a seed.
Scene random_scene(std::uint64_t seed) {
  Random random(seed, 0);
  Scene scene;
  scene.add_ground("floor", PlaneLabel::kFloor, {-6, -6, 6, 6}, 0, {{1, 1, 3, 2}, {-3, -2, -1, 1}});
  scene.add_hole_walls("hole", {1, 1, 3, 2}, 0, 0.3);
  for (int i = 0; i < 8; ++i) {
    const SO3 R =
        SO3::exp({random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), random.uniform(-3, 3)});
    scene.add_box("box" + std::to_string(i),
                  SE3(R, {random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-0.5, 2)}),
                  {random.uniform(0.1, 1.5), random.uniform(0.1, 1.5), random.uniform(0.1, 1.5)});
  }
  scene.add_ramp("ramp", SE3::planar(-4, 3, 0.3), 2, 1, 0.4);
  scene.add_cylinder({"post", {2, -2, 0}, Eigen::Vector3d::UnitZ(), 0.1, 1.5});
  scene.add_cylinder({"rail", {-2, -4, 1}, Eigen::Vector3d::UnitY(), 0.05, 3});
  return scene;
}

TEST(Caster, FloorAndBoxByHand) {
  Scene scene;
  scene.add_ground("floor", PlaneLabel::kFloor, {-5, -5, 5, 5}, 0);
  scene.add_box("box", SE3::planar(3, 0, 0), {1, 1, 0.5});
  const Caster caster(scene);
  const auto front = caster.cast({0, 0, 0.25}, {1, 0, 0});
  ASSERT_TRUE(front);
  EXPECT_DOUBLE_EQ(front->range, 2.5);
  EXPECT_NEAR((front->normal_map - Eigen::Vector3d(-1, 0, 0)).norm(), 0, 1e-12);
  EXPECT_EQ(scene.planes()[static_cast<std::size_t>(caster.plane_of(front->surface))].name,
            "box.back");
  const auto down = caster.cast({0, 0, 2}, {0, 0, -1});
  ASSERT_TRUE(down);
  EXPECT_DOUBLE_EQ(down->range, 2);
  EXPECT_FALSE(caster.cast({0, 0, 2}, {0, 0, 1}));
  EXPECT_FALSE(caster.cast({0, 0, 2}, {0, 0, -1}, 1e-6, 1.9));
}

TEST(Caster, GroundWithOpeningHasItsHoleAndNoSeams) {
  Scene scene;
  scene.add_ground("floor", PlaneLabel::kFloor, {-2, -2, 2, 2}, 0,
                   {{-1, -1, 0, 0}, {0.5, 0.5, 1, 1}});
  EXPECT_NEAR(scene.planes()[0].area, 16 - 1 - 0.25, 1e-12);
  const Caster caster(scene);
  for (int i = -20; i <= 20; ++i) {
    for (int j = -20; j <= 20; ++j) {
      const double x = 0.1 * i, y = 0.1 * j;
      const bool open = (x > -0.999 && x < -0.001 && y > -0.999 && y < -0.001) ||
                        (x > 0.501 && x < 0.999 && y > 0.501 && y < 0.999);
      EXPECT_EQ(caster.cast({x, y, 1}, {0, 0, -1}).has_value(), !open) << x << " " << y;
    }
  }
}

TEST(Caster, CylinderByHand) {
  Scene scene;
  scene.add_cylinder({"post", {3, 0, 0}, Eigen::Vector3d::UnitZ(), 0.5, 1});
  const Caster caster(scene);
  const auto hit = caster.cast({0, 0, 0.5}, {1, 0, 0});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->range, 2.5, 1e-12);
  EXPECT_EQ(caster.plane_of(hit->surface), -1);
  EXPECT_FALSE(caster.cast({0, 0, 1.1}, {1, 0, 0}));
}

TEST(Caster, TreeAgreesWithTryingEverySurface) {
  const Scene scene = random_scene(3);
  const Caster caster(scene);
  Random random(4, 0);
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d origin(random.uniform(-5, 5), random.uniform(-5, 5),
                                 random.uniform(0, 3));
    const Eigen::Vector3d direction(random.normal(), random.normal(), random.normal());
    double nearest = 1e9;
    for (const Face& face : scene.faces()) {
      const auto range = cast_face(face, origin, direction);
      nearest = range && *range > 1e-6 ? std::min(nearest, *range) : nearest;
    }
    for (const Cylinder& cylinder : scene.cylinders()) {
      nearest = std::min(nearest, cast_cylinder(cylinder, origin, direction, 1e-6).value_or(1e9));
    }
    const auto hit = caster.cast(origin, direction);
    ASSERT_EQ(hit.has_value(), nearest < 1e9);
    if (hit) {
      EXPECT_DOUBLE_EQ(hit->range, nearest);
      ++hits;
    }
  }
  EXPECT_GT(hits, 1000);
}

// The image is drawn by projection; each pixel must be what a ray finds there.
TEST(DepthRenderer, ImageAgreesWithRays) {
  for (std::uint64_t seed : {1, 2, 3, 4}) {
    const Scene scene = random_scene(seed);
    const Caster caster(scene);
    Random random(seed, 9);
    const SE3 T_map_camera =
        SE3::planar(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-3, 3)) *
        mount_camera({0, 0, 1.1}, 0, 0.35, 0.1);
    DepthCamera camera = kinect_camera(SE3());
    const DepthRenderer renderer(caster, camera, DepthEffects::none(), 1);
    const DepthTruth image = renderer.truth(T_map_camera);
    const CameraModel& c = camera.camera;
    int seen = 0, differ = 0;
    for (int v = 0; v < c.height; v += 7) {
      for (int u = 0; u < c.width; u += 5) {
        const Eigen::Vector3d ray((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1);
        const auto hit = caster.cast(T_map_camera.translation(), T_map_camera.so3() * ray, 1e-3);
        const double w = static_cast<double>(image.inverse_depth[image.index(u, v)]);
        const double expected = hit ? 1 / hit->range : 0;
        // A pixel that falls on an edge to rounding may show either side.
        differ += std::abs(w - expected) > 2e-7 * std::max(1.0, expected) ? 1 : 0;
        seen += hit ? 1 : 0;
      }
    }
    EXPECT_GT(seen, 3000) << "seed " << seed;
    EXPECT_LE(differ, 1) << "seed " << seed;
  }
}

TEST(LidarSimulator, ScanAgreesWithRaysInAnyMounting) {
  for (std::uint64_t seed : {5, 6, 7, 8, 9}) {
    const Scene scene = random_scene(seed);
    const Caster caster(scene);
    Random random(seed, 11);
    const SE3 T_map_lidar(SO3::exp({random.normal(), random.normal(), random.normal()}),
                          {random.uniform(-2, 2), random.uniform(-2, 2), 1.2});
    LidarGeometry geometry;
    geometry.angle_min = seed % 2 == 0 ? 3.0 : -2.0;
    geometry.angle_increment = seed % 2 == 0 ? -0.0087 : 0.0087;
    const LidarSimulator lidar(caster, {}, geometry, LidarEffects::none(), 1);
    const ScanTruth scan = lidar.truth(T_map_lidar);
    int seen = 0;
    for (int i = 0; i < geometry.beams; ++i) {
      const double angle = geometry.angle_min + i * geometry.angle_increment;
      const auto hit = caster.cast(
          T_map_lidar.translation(),
          T_map_lidar.so3() * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0), 1e-6, 30);
      const double expected = hit && hit->range >= geometry.range_min ? hit->range : 0;
      EXPECT_NEAR(scan.ranges[static_cast<std::size_t>(i)], expected, 1e-9)
          << seed << " beam " << i;
      seen += hit ? 1 : 0;
    }
    EXPECT_GT(seen, 80) << seed;
  }
}

}  // namespace
}  // namespace lamina::sim
