// Odometry between instants.
#include <gtest/gtest.h>

#include <lamina/frontend/motion/wheel_odometry.hpp>

namespace lamina {
namespace {

Odometry sample(double time, double x, double yaw = 0) {
  return {Timestamp::from_seconds(time), SE3::planar(x, 0, yaw)};
}

TEST(WheelTrack, InterpolatesBetweenSamples) {
  WheelTrack track{OdometryModel{}};
  track.add(sample(0, 0));
  track.add(sample(1, 2));
  const auto moved = track.between(Timestamp::from_seconds(0.25), Timestamp::from_seconds(0.75));
  ASSERT_TRUE(moved);
  EXPECT_NEAR(moved->T_from_to.translation().x(), 1.0, 1e-12);
}

TEST(WheelTrack, UncertaintyGrowsWithThePathAndNotWithItsEnds) {
  WheelTrack there_and_back{OdometryModel{}}, still{OdometryModel{}};
  for (int i = 0; i <= 10; ++i) {
    there_and_back.add(sample(i, i <= 5 ? i : 10 - i));
    still.add(sample(i, 0));
  }
  const auto from = Timestamp::from_seconds(0), to = Timestamp::from_seconds(10);
  const auto a = there_and_back.between(from, to), b = still.between(from, to);
  ASSERT_TRUE(a && b);
  EXPECT_LT((a->T_from_to.translation() - b->T_from_to.translation()).norm(), 1e-12);
  EXPECT_GT(a->covariance(0, 0), 10 * b->covariance(0, 0));
}

TEST(WheelTrack, KnowsWhetherItEverMoved) {
  WheelTrack track{OdometryModel{}};
  for (int i = 0; i < 3; ++i) track.add(sample(i, 2, 0.5));
  EXPECT_FALSE(track.moved());
  track.add(sample(3, 2, 0.5 + 1e-9));
  EXPECT_TRUE(track.moved());
  track.add(sample(4, 2, 0.5 + 1e-9));
  EXPECT_TRUE(track.moved());
}

TEST(WheelTrack, RefusesStampsFarOutside) {
  WheelTrack track{OdometryModel{}};
  const auto at = [](double t) { return Timestamp::from_seconds(t); };
  EXPECT_FALSE(track.between(at(0), at(0)));
  track.add(sample(1, 0));
  EXPECT_TRUE(track.at(at(1)));
  EXPECT_FALSE(track.at(at(1.1)));  // driving or standing: who knows
  track.add(sample(1.1, 0));
  EXPECT_FALSE(track.between(at(0), at(1)));
  EXPECT_FALSE(track.between(at(1), at(3)));
  EXPECT_TRUE(track.between(at(0.9), at(1.3)));
}

TEST(WheelTrack, DoesNotStandStillBesideAnEndAtWhichItDrove) {
  WheelTrack track{OdometryModel{}};
  const auto at = [](double t) { return Timestamp::from_seconds(t); };
  for (int i = 0; i < 5; ++i) track.add(sample(1 + 0.1 * i, 0.05 * i));
  EXPECT_TRUE(track.between(at(1), at(1.4)));
  EXPECT_FALSE(track.between(at(0.9), at(1.2)));
  EXPECT_FALSE(track.between(at(1.2), at(1.5)));
}

TEST(WheelTrack, SaysNothingInAHoleAndWhatWasDrivenAcrossIt) {
  WheelTrack track{OdometryModel{}};
  const auto at = [](double t) { return Timestamp::from_seconds(t); };
  for (const double t : {0.0, 0.1, 3.0, 3.1, 6.0}) track.add(sample(t, t < 1 ? 0 : 2));
  EXPECT_FALSE(track.at(at(1.5)));
  EXPECT_TRUE(track.at(at(4.5)));  // it stood
  EXPECT_FALSE(track.velocity(at(0.05), at(0.15)));
  EXPECT_FALSE(track.velocity(at(2.9), at(3)));
  const auto across = track.between(at(0.1), at(3));
  ASSERT_TRUE(across);
  EXPECT_NEAR(across->T_from_to.translation().x(), 2, 1e-12);
}

// Readers may give odometry at scans alone, and these may be seconds apart.
TEST(WheelTrack, SlowSamplesLeaveNoHole) {
  const auto at = [](double t) { return Timestamp::from_seconds(t); };
  WheelTrack slow{OdometryModel{}}, fast{OdometryModel{}};
  for (int i = 0; i < 5; ++i) slow.add(sample(2.5 * i, i));
  for (int i = 0; i < 5; ++i) fast.add(sample(0.25 * i, i));
  EXPECT_TRUE(slow.at(at(6)));
  const auto over = slow.between(at(5), at(7.5)), same = fast.between(at(0.5), at(0.75));
  ASSERT_TRUE(over && same);
  EXPECT_NEAR((over->covariance - same->covariance).norm(), 0, 1e-12);
}

TEST(WheelTrack, ALeapIsNoWay) {
  WheelTrack track{OdometryModel{}};
  const auto at = [](double t) { return Timestamp::from_seconds(t); };
  for (int i = 0; i < 6; ++i) track.add(sample(0.1 * i, 0.1 * i + (i > 2 ? 5e6 : 0)));
  EXPECT_FALSE(track.between(at(0.1), at(0.4)));
  const auto after = track.between(at(0.3), at(0.4));
  ASSERT_TRUE(after);
  EXPECT_NEAR(after->T_from_to.translation().x(), 0.1, 1e-8);
}

TEST(WheelTrack, VelocityIsThatOfTheTimeAskedForOrOfTheNewestThereIs) {
  WheelTrack track{OdometryModel{}};
  const auto at = [](double t) { return Timestamp::from_seconds(t); };
  track.add(sample(0, 0));
  EXPECT_FALSE(track.velocity(at(0), at(0.1)));
  track.add(sample(0.1, 0.1));
  track.add(sample(0.2, 0.1, 0.3));
  const auto driving = track.velocity(at(0), at(0.1)), turning = track.velocity(at(0.15), at(0.2)),
             newest = track.velocity(at(0.2), at(0.25)), both = track.velocity(at(0.2), at(0.4));
  ASSERT_TRUE(driving && turning && newest && both);
  EXPECT_NEAR((*driving)(0), 1, 1e-9);
  EXPECT_NEAR((*driving)(5), 0, 1e-9);
  EXPECT_NEAR((*turning)(5), 3, 1e-9);
  EXPECT_NEAR((*newest)(5), 3, 1e-9);
  EXPECT_NEAR((*both)(5), 1.5, 1e-9);
  EXPECT_FALSE(track.velocity(at(1), at(1.1)));
}

TEST(WheelTrack, ForgetsWhatIsNoLongerAskedFor) {
  WheelTrack track{OdometryModel{}};
  for (int i = 0; i < 100; ++i) track.add(sample(i, i));
  track.forget_before(Timestamp::from_seconds(90.5));
  const auto moved = track.between(Timestamp::from_seconds(90.5), Timestamp::from_seconds(99));
  ASSERT_TRUE(moved);
  EXPECT_NEAR(moved->T_from_to.translation().x(), 8.5, 1e-12);
}

}  // namespace
}  // namespace lamina
