// Bands of heights out of clouds.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/cloud_slice.hpp>

namespace lamina {
namespace {

// A sensor 0.8 m up that is turned and leans: posts at known places of the body come back there.
TEST(CloudSlice, PointsOfTheBandAreWhereTheyStand) {
  const SE3 T_body_sensor(SO3::rot_z(0.7) * SO3::rot_y(0.2), {0.3, -0.1, 0.8});
  const CloudSlice slice = parse_cloud_slice("0.2,0.6");
  std::vector<std::array<float, 3>> points;
  const auto add = [&](double x, double y, double z) {
    const Eigen::Vector3d p = T_body_sensor.inverse() * Eigen::Vector3d(x, y, z);
    points.push_back(
        {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
  };
  add(2, 1, 0.3);
  add(3.7, 2.1, 0.3);  // behind the first
  add(-3, 0.5, 0.5);
  add(1, -2, 0.1);      // below
  add(1, -2, 0.7);      // above
  add(0.4, -0.1, 0.4);  // the robot itself
  const float none = std::numeric_limits<float>::quiet_NaN();
  points.push_back({none, none, none});
  const LaserScan scan = slice_of(points, T_body_sensor, slice);
  std::vector<Eigen::Vector3d> found;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (!scan.valid(i)) continue;
    const Eigen::Vector2d p = scan.point(i);
    found.push_back(scan.lidar.T_body_lidar * Eigen::Vector3d(p.x(), p.y(), 0));
  }
  ASSERT_EQ(found.size(), 2u);
  for (const Eigen::Vector3d& expected :
       {Eigen::Vector3d(2, 1, 0.4), Eigen::Vector3d(-3, 0.5, 0.4)}) {
    double nearest = 1;
    for (const Eigen::Vector3d& p : found) nearest = std::min(nearest, (p - expected).norm());
    EXPECT_LT(nearest, 4 * slice.step);  // beams have a width
  }
}

TEST(CloudSlice, BandsAreTwoNumbersInOrder) {
  EXPECT_EQ(parse_cloud_slice("-0.5,1").low, -0.5);
  for (const char* text : {"", "1", "1,", "1,0", "a,b", "0,1,2", "0.2, 0.6"})
    EXPECT_THROW(parse_cloud_slice(text), Error) << text;
}

}  // namespace
}  // namespace lamina
