// Motions of images between the scans that tell the motion, without wheels.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/frontend/frontend.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

Timestamp at(double seconds) { return Timestamp::from_seconds(1000 + seconds); }

// In a room of 6 x 3 m, `x` from its middle.
LaserScan scan(double seconds, double x = 0) {
  LaserScan scan;
  scan.stamp = at(seconds);
  scan.angle_min = -2;
  scan.angle_increment = 0.01;
  scan.range_min = 0.1;
  scan.range_max = 20;
  for (int i = 0; i <= 400; ++i) {
    const double a = scan.angle_min + scan.angle_increment * i, c = std::cos(a), s = std::sin(a);
    scan.ranges.push_back(static_cast<float>(
        std::min((c > 0 ? 3 - x : 3 + x) / std::max(std::abs(c), 1e-9), 1.5 / std::abs(s))));
  }
  return scan;
}

DepthFrame image(double seconds) {
  std::vector<testing::Piece> pieces;
  for (const Plane& plane : {Plane({0, 0, 1}, 0), Plane({-1, 0, 0}, -3), Plane({0, -1, 0}, -1.5)}) {
    pieces.push_back({plane});
  }
  DepthFrame frame = testing::draw(pieces, testing::small_test_camera(0.3), 0.02, 1);
  frame.stamp = at(seconds);
  return frame;
}

// One-sigma of the last motion: height (m), the larger of roll and pitch (rad), any (m, rad).
struct Freedom {
  double height = 0, tilt = 0, most = 0;
};
Freedom last_freedom(const std::vector<Measurement>& measurements, bool planar = true) {
  Calibration calibration;
  calibration.odometry.planar = planar;
  FrontEnd front_end({}, calibration);
  Diagnostics metrics;
  Freedom last;
  for (const Measurement& measurement : measurements) {
    const auto step = front_end.process(measurement, metrics);
    if (!step) continue;
    const Vector6d sigma = step->motion.covariance.diagonal().cwiseSqrt();
    last = {sigma(2), sigma.segment<2>(3).maxCoeff(), sigma.maxCoeff()};
  }
  return last;
}

// In 16 ms no body goes 30 cm, and one that stands on a floor does not tilt by 17 degrees.
TEST(ImagesBetweenScans, TheFirstOneIsNoGuess) {
  const Freedom freedom = last_freedom({scan(0.021), image(0.037)});
  EXPECT_LT(freedom.height, 0.003);
  EXPECT_LT(freedom.tilt, 0.002);
  EXPECT_LT(freedom.most, 0.04);
}

TEST(ImagesBetweenScans, AreAsLevelAsScans) {
  const Freedom freedom = last_freedom({scan(0), scan(0.1), image(0.183)});
  EXPECT_LT(freedom.height, 0.003);
  EXPECT_LT(freedom.tilt, 0.002);
}

TEST(ImagesBetweenScans, TheFirstScanAfterImagesIsToo) {
  const Freedom freedom = last_freedom({image(0), image(0.1), scan(0.19)});
  EXPECT_LT(freedom.height, 0.003);
  EXPECT_LT(freedom.tilt, 0.002);
}

// An image of the first scan's own instant does not say that the body stands still.
TEST(ImagesBetweenScans, TheFirstScansTellOfTheWay) {
  FrontEnd front_end({}, {});
  Diagnostics metrics;
  front_end.process(scan(0), metrics);
  front_end.process(image(0), metrics);
  const auto step = front_end.process(scan(0.1, 0.05), metrics);
  ASSERT_TRUE(step);
  EXPECT_NEAR(step->motion.T_from_to.translation().x(), 0.05, 0.005);
}

TEST(ImagesBetweenScans, WhatFliesMayTilt) {
  EXPECT_GT(last_freedom({scan(0), scan(0.1), image(0.183)}, false).tilt, 0.005);
}

// How far the camera is turned from its calibration by an image of a floor that leans by 3 degrees.
double turned_by_leaning_floor(bool planar) {
  Calibration calibration;
  calibration.odometry.planar = planar;
  FrontEnd front_end({}, calibration);
  Diagnostics metrics;
  front_end.process(Odometry{at(0), SE3()}, metrics);
  front_end.process(Odometry{at(1), SE3()}, metrics);
  const double lean = 3 * M_PI / 180;
  const Plane floor({std::sin(lean), 0, std::cos(lean)}, 0);
  DepthFrame frame = testing::draw({{floor}}, testing::small_test_camera(0.3), 0.02, 1);
  frame.stamp = at(0.5);
  const auto step = front_end.process(frame, metrics);
  const SE3& T_body_camera = frame.camera.camera.T_body_camera;
  return (T_body_camera.inverse() * step->observations.T_body_sensor).so3().log().norm();
}

// What stands on a floor is level with it, what flies is not.
TEST(LeaningFloor, TurnsTheCameraOnABodyThatStandsOnItAlone) {
  EXPECT_GT(turned_by_leaning_floor(true), 0.03);
  EXPECT_EQ(turned_by_leaning_floor(false), 0);
}

}  // namespace
}  // namespace lamina
