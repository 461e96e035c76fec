// Motions that are corrected before they are mapped.
#include <gtest/gtest.h>

#include <lamina/apps/wheel_calibration.hpp>

#include "../backend/mapper_room.hpp"

namespace lamina::apps {
namespace {

// A lap and a half of a room by wheels whose increments must be corrected by `errors`.
std::vector<Step> steps_with(const Eigen::Vector4d& errors, const made_up::Drive& drive) {
  const auto room = made_up::make_room();
  made_up::Sensor sensor(62);
  std::vector<Step> steps(drive.truth.size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    steps[i].observations = sensor.depth(drive.truth[i], made_up::at_frame(i), room);
    steps[i].motion = {drive.truth[0], drive.covariance};
    if (i > 0) steps[i].motion.T_from_to = corrected(drive.increments[i - 1], -errors);
  }
  return steps;
}

double heading_error(const std::vector<Step>& steps, const made_up::Drive& drive) {
  SE3 T;
  for (const Step& step : steps) T = T * step.motion.T_from_to;
  return std::abs((drive.truth.back().inverse() * T).so3().yaw());
}

TEST(WheelCalibration, MotionsComeOutStraight) {
  const made_up::Drive drive(180, 120, 61);
  std::vector<Step> steps = steps_with({0.02, 0.02, 0, 0.03}, drive);
  const SO3 mounted = steps[7].observations.T_body_sensor.so3();
  // What nothing measured is no word of the wheels.
  steps[20].motion_known = false;
  const SE3 guessed = steps[20].motion.T_from_to;
  const double before = heading_error(steps, drive);
  const auto errors = calibrate_wheels(steps, {}, [] { return false; });
  ASSERT_TRUE(errors);
  EXPECT_NEAR(errors->value(0), 0.02, 0.01);
  EXPECT_NEAR(errors->value(1), 0.02, 0.005);
  EXPECT_NEAR(errors->value(3), 0.03, 0.01);
  const SO3 turned = steps[7].observations.T_body_sensor.so3() * mounted.inverse();
  EXPECT_NEAR(turned.yaw(), -errors->value(3), 1e-9);
  EXPECT_GT(before, 0.2);
  EXPECT_LT(heading_error(steps, drive), 0.3 * before);
  EXPECT_EQ(steps[20].motion.T_from_to.translation(), guessed.translation());
  EXPECT_EQ(steps[0].motion.T_from_to.translation(), drive.truth[0].translation());
}

TEST(WheelCalibration, EndedEarlyNothingIsTouched) {
  const made_up::Drive drive(30, 120, 61);
  std::vector<Step> steps = steps_with({0.02, 0.02, 0, 0}, drive);
  const SE3 before = steps[9].motion.T_from_to;
  EXPECT_FALSE(calibrate_wheels(steps, {}, [] { return true; }));
  EXPECT_EQ(steps[9].motion.T_from_to.translation(), before.translation());
}

TEST(WheelCalibration, ScansAreAnotherMatter) {
  std::vector<Step> steps(3);
  EXPECT_TRUE(wheels_and_images_alone(steps));
  steps[1].scan.emplace();
  EXPECT_FALSE(wheels_and_images_alone(steps));
}

}  // namespace
}  // namespace lamina::apps
