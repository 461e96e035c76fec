// Wheels that slip beside a scanner and a depth camera.
#include <gtest/gtest.h>

#include <lamina/frontend/frontend.hpp>

#include "frontend/depth/depth_scene.hpp"
#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

constexpr double kStep = 0.05;  // m a scan
constexpr int kScans = 50, kFrom = 15, kTo = 40;
constexpr double kSlip = 0.03;  // m more that wheels count between the latter two, a scan

Timestamp at(int scan) { return Timestamp::from_seconds(1000 + 0.1 * scan); }

// Floor that rises by ten degrees from 1.2 m ahead on.
DepthFrame image_of_ramp(int scan) {
  const double slope = 10 * M_PI / 180, foot = 1.2;
  const auto before = [](const Eigen::Vector3d& p) { return p.x() < 1.2; };
  const auto behind = [](const Eigen::Vector3d& p) { return p.x() >= 1.2; };
  const Eigen::Vector3d up(-std::sin(slope), 0, std::cos(slope));
  DepthFrame frame =
      testing::draw({{Plane({0, 0, 1}, 0), before}, {Plane(up, up.x() * foot), behind}},
                    testing::small_test_camera(0.3), 0.02, 1);
  frame.stamp = at(scan);
  return frame;
}

// m that the path is off at its end, of wheels that slipped by 0.75 m.
double off_after_slip(bool ramp_in_view) {
  Calibration calibration;
  calibration.depth_camera.emplace();
  FrontEnd front_end({}, calibration);
  testing::Scanner scanner;
  scanner.fov = M_PI;
  scanner.range_max = 8;
  Diagnostics metrics;
  double counted = 0;
  SE3 T_start_body;
  for (int i = 0; i < kScans; ++i) {
    if (i > 0) counted += kStep + (i >= kFrom && i < kTo ? kSlip : 0);
    front_end.process(Odometry{at(i), SE3::planar(counted, 0, 0)}, metrics);
    if (ramp_in_view && i == 10) {
      front_end.process(image_of_ramp(i), metrics);
      EXPECT_EQ(front_end.motion().slopes().images(), 1);
    }
    const LaserScan scan =
        scanner.scan(testing::niches(), SE3::planar(kStep * i, 0, 0), at(i).seconds());
    T_start_body = front_end.process(scan, metrics)->T_start_body;
  }
  return std::abs(T_start_body.translation().x() - (kScans - 1) * kStep);
}

TEST(WheelsThatSlip, AreFoundOutBesideACamera) { EXPECT_LT(off_after_slip(false), 0.1); }

// Its ground may pass for a wall that goes ahead.
TEST(WheelsThatSlip, AreBelievedWhereARampIsInView) { EXPECT_GT(off_after_slip(true), 0.2); }

}  // namespace
}  // namespace lamina
