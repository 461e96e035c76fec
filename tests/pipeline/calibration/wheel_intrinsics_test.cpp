// Motions that are corrected before they are mapped.
#include <gtest/gtest.h>

#include <lamina/pipeline/calibration/wheel_intrinsics.hpp>

#include "backend/mapper/mapper_room.hpp"

namespace lamina {
namespace {

// As a run does it: found, and applied where adopted.
std::optional<WheelCalibration> corrected(std::vector<Step>& steps, bool remounting) {
  const auto found = calibrate_wheels(steps, {}, remounting, [] { return false; });
  if (found && found->adoption.adopted) apply_correction(steps, *found);
  return found;
}

// A lap and a half of a room by wheels whose increments must be corrected by `errors`.
std::vector<Step> steps_with(const WheelErrors::Vector& errors, const made_up::Drive& drive) {
  const auto room = made_up::make_room();
  made_up::Sensor sensor(62);
  std::vector<Step> steps(drive.truth.size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    steps[i].observations = sensor.depth(drive.truth[i], made_up::at_frame(3 * i), room);
    steps[i].motion = {drive.truth[0], drive.covariance};
    if (i > 0) steps[i].motion.T_from_to = corrected(drive.increments[i - 1], -errors);
  }
  return steps;
}

// The same surface in the frame of a sensor that does not sit in the body's middle.
PlaneObservation seen_from(const SE3& T_body_sensor, PlaneObservation plane) {
  const SE3 T_sensor_body = T_body_sensor.inverse();
  plane.moments_sensor = plane.moments_sensor.transformed(T_sensor_body);
  plane.plane_sensor = T_sensor_body * plane.plane_sensor;
  for (Eigen::Vector3d& corner : plane.outline_sensor) corner = T_sensor_body * corner;
  return plane;
}

double heading_error(const std::vector<Step>& steps, const made_up::Drive& drive) {
  SE3 T;
  for (const Step& step : steps) T = T * step.motion.T_from_to;
  return std::abs((drive.truth.back().inverse() * T).so3().yaw());
}

TEST(WheelCalibration, MotionsComeOutStraight) {
  const made_up::Drive drive(180, 120, 61);
  std::vector<Step> steps = steps_with(WheelErrors::of(0.02, 0.02, 0, 0.03), drive);
  const SO3 mounted = steps[7].observations.T_body_sensor.so3();
  // What nothing measured is no word of the wheels.
  steps[20].motion_known = false;
  const SE3 guessed = steps[20].motion.T_from_to;
  const double before = heading_error(steps, drive);
  const auto found = corrected(steps, true);
  ASSERT_TRUE(found);
  const WheelErrors* errors = &found->errors;
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

// A camera that sits 4.5 cm before and 3 cm beside where it is said to.
TEST(WheelCalibration, CamerasMoveToTheirPlace) {
  const made_up::Drive drive(180, 120, 61);
  const Eigen::Vector2d off(0.045, -0.03);
  // The body of these steps is the frame in which the camera is said to sit.
  std::vector<Step> steps = steps_with(WheelErrors::of(0, 0, 0, 0, off.x(), off.y()), drive);
  const SE3 said = SE3::from_translation({0.3, 0.1, 0.5});
  for (Step& step : steps) {
    for (PlaneObservation& plane : step.observations.planes) plane = seen_from(said, plane);
    step.observations.T_body_sensor = said;
  }
  const auto found = corrected(steps, true);
  ASSERT_TRUE(found);
  const Eigen::Vector3d moved = found->cameras.translation_body;
  EXPECT_LT((moved.head<2>() - off).norm(), 0.015);  // 5 mm of sigma each way
  EXPECT_LT((steps[5].observations.T_body_sensor.translation() - said.translation() - moved).norm(),
            1e-9);
}

TEST(WheelCalibration, WithoutRemountingCamerasStay) {
  const made_up::Drive drive(130, 120, 61);
  std::vector<Step> steps = steps_with(WheelErrors::of(0.03, 0.02, 0, 0.04), drive);
  const auto found = corrected(steps, false);
  ASSERT_TRUE(found);
  EXPECT_GT(found->errors.value(0), 0.01);
  EXPECT_LT(steps[5].observations.T_body_sensor.log().norm(), 1e-3);
}

// Said to sit in the very middle, it is nowhere.
TEST(WheelCalibration, PlacesNobodyStatedStay) {
  const made_up::Drive drive(130, 120, 61);
  std::vector<Step> steps = steps_with(WheelErrors::of(0.03, 0, 0, 0, 0.05, 0.02), drive);
  corrected(steps, true);
  EXPECT_LT(steps[5].observations.T_body_sensor.translation().norm(), 1e-3);
}

TEST(WheelCalibration, EndedEarlyNothingIsTouched) {
  const made_up::Drive drive(30, 120, 61);
  std::vector<Step> steps = steps_with(WheelErrors::of(0.02, 0.02, 0), drive);
  const SE3 before = steps[9].motion.T_from_to;
  EXPECT_FALSE(calibrate_wheels(steps, {}, true, [] { return true; }));
  EXPECT_EQ(steps[9].motion.T_from_to.translation(), before.translation());
}

TEST(WheelCalibration, ScansAreAnotherMatter) {
  std::vector<Step> steps(3);
  EXPECT_TRUE(wheels_and_images_alone(steps));
  steps[1].scan.emplace();
  EXPECT_FALSE(wheels_and_images_alone(steps));
}

}  // namespace
}  // namespace lamina
