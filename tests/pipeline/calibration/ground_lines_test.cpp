// Where a scanner or camera sits, told by what it sees.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <lamina/pipeline/calibration/ground_lines.hpp>
#include <lamina/pipeline/calibration/shared_walls.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;

// A scanner's line through two points of the body frame (in the scan plane).
SegmentObservation line(const SE3& T_body_lidar, const Eigen::Vector3d& a,
                        const Eigen::Vector3d& b) {
  SegmentObservation o;
  o.segment.start = (T_body_lidar.inverse() * a).head<2>();
  o.segment.end = (T_body_lidar.inverse() * b).head<2>();
  return o;
}

// Upright on the robot's left side: x of the scan to the left, y up.
SE3 upright() {
  Eigen::Matrix3d R;
  R.col(0) = Eigen::Vector3d::UnitY();
  R.col(1) = Eigen::Vector3d::UnitZ();
  R.col(2) = Eigen::Vector3d::UnitX();
  return SE3(SO3(Eigen::Quaterniond(R)), {0.1, 0.2, 0.6});
}

// Scans of bumpy ground beside a facade, by a scanner that is said to sit at T_said.
GroundLines ground_by(const SE3& T_said, std::size_t scans, double share_of_kerbs) {
  const SE3 T = upright();
  GroundLines lines;
  std::mt19937 random(5);
  std::normal_distribution<double> bump(0, 0.003);
  for (std::size_t i = 0; i < scans; ++i) {
    Observations o;
    o.stamp = Timestamp::from_seconds(1000 + 0.4 * static_cast<double>(i));
    o.T_body_sensor = T_said;
    const double kerb =
        static_cast<double>(i) < share_of_kerbs * static_cast<double>(scans) ? 0.12 : 0;
    o.segments.push_back(line(T, {0.1, 0.5, kerb + bump(random)}, {0.1, 4, kerb + bump(random)}));
    o.segments.push_back(line(T, {0.1, 4, 0}, {0.1, 4, 3}));
    lines.add(o);
  }
  return lines;
}

TEST(GroundLines, TellLeanAndHeight) {
  const MountingCorrection error{{1.2 * kDegree, 0, 0}, {0, 0, 0.015}};
  const auto found = ground_by(error.apply(upright()), 100, 0.3).correction();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->rotation_body.x(), -1.2 * kDegree, 0.1 * kDegree);
  EXPECT_NEAR(found->rotation_body.y(), 0, 0.1 * kDegree);
  EXPECT_NEAR(found->translation_body.z(), -0.015, 0.004);
}

TEST(GroundLines, AMountingInOrderStays) {
  EXPECT_FALSE(ground_by(upright(), 100, 0.2).correction());
}

TEST(GroundLines, FewScansOrFewLinesTellNothing) {
  const SE3 T_said = MountingCorrection{{1.2 * kDegree, 0, 0}, {0, 0, 0}}.apply(upright());
  EXPECT_FALSE(ground_by(T_said, 20, 0).correction());
  GroundLines lines = ground_by(T_said, 100, 0);
  Observations none;
  for (int i = 0; i < 150; ++i) lines.add(none);
  EXPECT_FALSE(lines.correction());
}

// A drive through a square room, seen by a level scanner and by a camera said to sit at T_said.
SharedWalls walls_by(const SE3& T_camera, const SE3& T_said, int images) {
  const SE3 T_lidar(SO3::rot_z(2), {0.2, 0, 0.3});
  SharedWalls walls;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.002);
  for (int i = 0; i < images; ++i) {
    const SE3 T_map_body = SE3::planar(0.02 * i - 1, 0.3, 0.06 * i);
    Observations scan, image;
    scan.stamp = image.stamp = Timestamp::from_seconds(1000 + 0.4 * i);
    scan.T_body_sensor = T_lidar;
    image.T_body_sensor = T_said;
    for (int side = 0; side < 4; ++side) {
      const SO3 turn = SO3::rot_z(side * M_PI / 2);
      const Eigen::Vector3d a = turn * Eigen::Vector3d(4, -3 + noise(random), 0.3);
      const Eigen::Vector3d b = turn * Eigen::Vector3d(4, 3 + noise(random), 0.3);
      scan.segments.push_back(line(T_lidar, T_map_body.inverse() * a, T_map_body.inverse() * b));
      PlaneObservation wall;
      const SE3 T_camera_map = (T_map_body * T_camera).inverse();
      wall.plane_sensor = T_camera_map * Plane(turn * -Eigen::Vector3d::UnitX(), -4);
      for (const double y : {-1.0, 1.5}) {
        for (const double z : {0.1, 1.5}) {
          const Eigen::Vector3d p = T_camera_map * (turn * Eigen::Vector3d(4, y, z));
          wall.outline_sensor.push_back(p);
          wall.moments_sensor.add(p);
        }
      }
      image.planes.push_back(wall);
    }
    walls.add_scan(scan, T_map_body);
    walls.add_image(image, T_map_body);
  }
  return walls;
}

TEST(SharedWalls, TellHeadingAndPlaceOfACamera) {
  const SE3 T_camera(SO3::rot_z(-M_PI / 2) * SO3::rot_x(-2), {0.1, 0, 0.8});
  const MountingCorrection error{{0, 0, 2 * kDegree}, {0.03, -0.02, 0}};
  const auto found = walls_by(T_camera, error.apply(T_camera), 100).result();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->correction.rotation_body.z(), -2 * kDegree, 0.1 * kDegree);
  EXPECT_NEAR(found->correction.translation_body.x(), -0.03, 0.005);
  EXPECT_NEAR(found->correction.translation_body.y(), 0.02, 0.005);
  EXPECT_EQ(found->correction.translation_body.z(), 0);
  EXPECT_GT(found->pairs, 300);
  EXPECT_TRUE(found->is_significant);
}

TEST(SharedWalls, AMountingInOrderAndFewImagesTellNothing) {
  const SE3 T_camera(SO3::rot_z(-M_PI / 2) * SO3::rot_x(-2), {0.1, 0, 0.8});
  const auto in_order = walls_by(T_camera, T_camera, 100).result();
  ASSERT_TRUE(in_order);
  EXPECT_FALSE(in_order->is_significant);
  const MountingCorrection error{{0, 0, 2 * kDegree}, {0, 0, 0}};
  EXPECT_FALSE(walls_by(T_camera, error.apply(T_camera), 6).result());
}

}  // namespace
}  // namespace lamina
