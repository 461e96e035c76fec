// Odometry asked for at the times of other sensors.
#include <gtest/gtest.h>

#include <lamina/sensors/odometry_track.hpp>

namespace lamina {
namespace {

Timestamp at(double seconds) { return Timestamp::from_seconds(seconds); }

// Ten samples a second at 1 m/s, left out where `hole` says so.
OdometryTrack driving(double hole_from = 1e9, double hole_to = 1e9) {
  std::vector<Odometry> samples;
  for (int i = 0; i <= 100; ++i) {
    const double t = 0.1 * i;
    if (t > hole_from + 1e-6 && t < hole_to - 1e-6) continue;
    samples.push_back({at(t), SE3::planar(t, 0, 0)});
  }
  return OdometryTrack(samples);
}

TEST(OdometryTrack, InterpolatesAndSaysSo) {
  const OdometryTrack track = driving();
  const auto between = track.at(at(1.25)), sample = track.at(at(2));
  ASSERT_TRUE(between && sample);
  EXPECT_NEAR(between->T_odom_body.translation().x(), 1.25, 1e-9);
  EXPECT_TRUE(between->interpolated);
  EXPECT_FALSE(sample->interpolated);
}

TEST(OdometryTrack, GoesOnBeyondItsEndsForAnIntervalAndAHalf) {
  const OdometryTrack track = driving();
  const auto after = track.at(at(10.1));
  ASSERT_TRUE(after);
  EXPECT_NEAR(after->T_odom_body.translation().x(), 10.1, 1e-9);
  EXPECT_TRUE(track.at(at(-0.1)));
  EXPECT_FALSE(track.at(at(10.2)));
  EXPECT_FALSE(track.at(at(-0.2)));
}

TEST(OdometryTrack, KnowsNoWayThroughAHole) {
  const OdometryTrack track = driving(4, 6);
  EXPECT_TRUE(track.at(at(4)));
  EXPECT_FALSE(track.at(at(5)));
  EXPECT_TRUE(track.at(at(6)));
  EXPECT_TRUE(driving(4, 4.9).at(at(4.5)));  // a few samples lost are none
}

// The ends of a hole are ends: just inside, the motion beside them is carried on.
TEST(OdometryTrack, JustInsideAHoleItsEndsGoOn) {
  const OdometryTrack track = driving(4, 6);
  for (const double t : {4.1, 5.9}) {
    const auto odometry = track.at(at(t));
    ASSERT_TRUE(odometry) << t;
    EXPECT_NEAR(odometry->T_odom_body.translation().x(), t, 1e-9);
    EXPECT_TRUE(odometry->interpolated);
  }
  EXPECT_FALSE(track.at(at(4.2)));
  EXPECT_FALSE(track.at(at(5.8)));
}

// Wheels that are heard of when they move, and slow ones.
TEST(OdometryTrack, SilenceOfABodyThatStandsIsNoHole) {
  std::vector<Odometry> samples;
  for (const double t : {0.0, 0.1, 0.2, 9.0, 9.1, 9.2}) {
    samples.push_back({at(t), SE3::planar(t < 1 ? t : t - 8.8, 0, 0)});
  }
  EXPECT_TRUE(OdometryTrack(samples).at(at(5)));
  std::vector<Odometry> slow;
  for (int i = 0; i < 5; ++i) slow.push_back({at(2 * i), SE3::planar(i, 0, 0)});
  EXPECT_TRUE(OdometryTrack(slow).at(at(3)));
}

}  // namespace
}  // namespace lamina
