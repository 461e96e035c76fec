// A camera that is knocked, and ranges that become others, from somewhere on.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/pipeline/calibration/sensor_changes.hpp>

namespace lamina {
namespace {

constexpr double kHeight = 0.8;

// An image every 0.5 s whose floor lies `tilt` (rad) and `height` off.
Step image(int i, double tilt, double height) {
  Step step;
  step.observations.stamp = Timestamp::from_seconds(100 + 0.5 * i);
  step.observations.T_body_sensor =
      SE3(SO3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)), {0.1, 0, kHeight});
  const double scatter = 0.002 * std::sin(7.0 * i);
  step.T_body_levelled = SE3(SO3::rot_y(tilt + scatter), {0, 0, height + scatter});
  step.T_start_body = SE3::planar(0.1 * i, 0, 0);
  const Eigen::Vector3d up_sensor = step.observations.T_body_sensor.so3().inverse() *
                                    (step.T_body_levelled.so3() * Eigen::Vector3d::UnitZ());
  PlaneObservation floor;
  floor.plane_sensor = Plane(up_sensor, -(kHeight - height));
  for (const double x : {0.0, 1.0}) {
    for (const double y : {0.0, 1.0}) floor.moments_sensor.add({x, y, -kHeight});
  }
  step.observations.planes.push_back(floor);
  step.obstacles.emplace();
  return step;
}

// A scan every 0.2 m, whose ranges are `scale` times as long.
Step scan(int i, double scale) {
  Step step;
  step.observations.stamp = Timestamp::from_seconds(100 + 0.5 * i);
  step.wheels_moved = SE3::planar(0.2, 0, 0);
  step.scan_motion.emplace();
  step.scan_motion->status = ScanMotion::Status::kTracked;
  step.scan_motion->T_prev_curr_body =
      SE3::planar(0.2 * scale * (1 + 0.02 * std::sin(5.0 * i)), 0, 0);
  return step;
}

TEST(SensorChanges, SaysWhenACameraMoves) {
  SensorChanges steady, knocked, other_unit, covered;
  for (int i = 0; i < 80; ++i) {
    Step bare = image(i, 0, 0);
    if (i > 40) bare.observations.planes.clear();
    covered.add(bare);
    steady.add(image(i, 0.01, 0));
    knocked.add(image(i, i < 40 ? 0 : 0.08, 0));
    other_unit.add(image(i, 0, i < 40 ? 0 : 0.2 * kHeight));
  }
  EXPECT_TRUE(steady.warnings().empty());
  ASSERT_EQ(knocked.warnings().size(), 1);
  EXPECT_EQ(knocked.warnings()[0].id, "camera_changes");
  EXPECT_NE(knocked.warnings()[0].text.find("pitch"), std::string::npos);
  EXPECT_NE(knocked.warnings()[0].text.find("at about 120"), std::string::npos);
  ASSERT_EQ(other_unit.warnings().size(), 1);
  EXPECT_NE(other_unit.warnings()[0].text.find("height"), std::string::npos);
  ASSERT_EQ(covered.warnings().size(), 1);
  EXPECT_NE(covered.warnings()[0].text.find("share of images"), std::string::npos);
}

TEST(SensorChanges, SaysWhenRangesBecomeOthers) {
  SensorChanges steady, longer;
  for (int i = 0; i < 400; ++i) {
    steady.add(scan(i, 1.03));
    longer.add(scan(i, i < 200 ? 1 : 1.08));
  }
  EXPECT_TRUE(steady.warnings().empty());
  ASSERT_EQ(longer.warnings().size(), 1);
  EXPECT_EQ(longer.warnings()[0].id, "ranges_change");
}

TEST(SensorChanges, NumbersMayBeOffByAHalf) {
  for (double SensorChangeOptions::*member :
       {&SensorChangeOptions::block, &SensorChangeOptions::moved, &SensorChangeOptions::level,
        &SensorChangeOptions::least_share, &SensorChangeOptions::least_tilt,
        &SensorChangeOptions::least_height, &SensorChangeOptions::least_ratio}) {
    for (const double k : {0.5, 1.5}) {
      SensorChangeOptions options;
      options.*member *= k;
      SensorChanges changes(options), steady(options);
      for (int i = 0; i < 400; ++i) {
        changes.add(image(i, i < 200 ? 0 : 0.08, 0));
        changes.add(scan(i, i < 200 ? 1 : 1.08));
        steady.add(image(i, 0, 0));
        steady.add(scan(i, 1));
      }
      EXPECT_EQ(changes.warnings().size(), 2);
      EXPECT_TRUE(steady.warnings().empty());
    }
  }
}

}  // namespace
}  // namespace lamina
