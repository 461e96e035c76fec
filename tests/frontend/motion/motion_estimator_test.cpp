// Ego-motion as a part used alone.
#include <gtest/gtest.h>

#include <lamina/frontend/motion/motion_estimator.hpp>

namespace lamina {
namespace {

Timestamp at(double seconds) { return Timestamp::from_seconds(1000 + seconds); }

SE3 ahead(double x) { return SE3(SO3(), {x, 0, 0}); }

// Half a metre a second; x counts on in a hole from 1 to 4 s.
MotionEstimator driven() {
  MotionEstimator motion({}, {});
  for (int k = 0; k <= 60; ++k) {
    const double t = 0.1 * k;
    if (t < 1.05 || t > 3.95) motion.wheels().add({at(t), ahead(0.5 * t)});
  }
  return motion;
}

// A step that nothing but wheels tells of, by a cloud.
Step cloud_at(double t, MotionEstimator& motion) {
  Step step;
  CloudFrame cloud;
  cloud.stamp = at(t);
  EXPECT_TRUE(motion.begin(cloud.stamp));
  motion.move(cloud, FloorResult(), motion.by_wheels(cloud.stamp, step), step);
  return step;
}

TEST(MotionEstimator, WheelsTellTheWayBetweenTwoSteps) {
  MotionEstimator motion = driven();
  cloud_at(0.2, motion);
  const Step step = cloud_at(0.8, motion);
  EXPECT_TRUE(step.motion_known);
  EXPECT_NEAR(step.motion.T_from_to.translation().x(), 0.3, 1e-9);
  EXPECT_TRUE(motion.wheels().met_on_floor());
  EXPECT_TRUE(motion.first_floor_map());
}

TEST(MotionEstimator, CountersGoOnAcrossAHole) {
  MotionEstimator motion = driven();
  cloud_at(0.5, motion);
  const Step inside = cloud_at(2.5, motion);
  EXPECT_FALSE(inside.motion_known);
  const Step after = cloud_at(5, motion);
  EXPECT_EQ(after.across_hole, 1);
  EXPECT_NEAR((motion.T_start_body().inverse() * ahead(2.5)).translation().norm(), 0, 1e-9);
}

TEST(MotionEstimator, AStampThatGoesBackIsNoStep) {
  MotionEstimator motion = driven();
  cloud_at(0.5, motion);
  EXPECT_FALSE(motion.begin(at(0.4)));
}

TEST(WheelMotion, TellsOdometryThatIsNoneFromOneThatStands) {
  WheelMotion late(OdometryModel(), true), still(OdometryModel(), true);
  for (const double t : {10.0, 11.0}) late.add({at(t), SE3()});
  for (const double t : {0.0, 1.0}) still.add({at(t), SE3()});
  late.meet(at(1), {});
  still.meet(at(1), {});
  EXPECT_TRUE(late.never_met());
  EXPECT_FALSE(late.never_moved());
  EXPECT_FALSE(still.never_met());
  EXPECT_TRUE(still.never_moved());
}

FloorResult two_slopes(double t) {
  FloorResult floor;
  floor.stamp = at(t);
  floor.pixel_labels.assign(100, 0);
  ExtractedPlane ramp;
  ramp.kind = PlaneKind::kSubDominant;
  ramp.slope = 0.1;
  ramp.pixels = 10;
  floor.planes.push_back(ramp);
  return floor;
}

TEST(SlopeWatch, ForgetsASlopeAfterSecondsOfDrivingNotOfStanding) {
  SlopeWatch slopes;
  slopes.add(two_slopes(0));
  EXPECT_EQ(slopes.images(), 1);
  EXPECT_TRUE(slopes.two_of_late(at(4)));
  EXPECT_FALSE(slopes.of_late(at(6)));
  slopes.stood(at(6), 5);
  EXPECT_TRUE(slopes.of_late(at(6)));
}

}  // namespace
}  // namespace lamina
