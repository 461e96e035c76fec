// Counters that are set anew on the way.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <lamina/sensors/odometry_leaps.hpp>

namespace lamina {
namespace {

// A robot at 0.5 m/s and 0.2 rad/s, twenty poses a second.
SE3 drive(double t) { return SE3::exp((Vector6d() << 0.5 * t, 0, 0, 0, 0, 0.2 * t).finished()); }

struct Counter {
  OdometryLeaps leaps;
  SE3 last;
  void add(double t, const SE3& T, bool interpolated = false) {
    last = leaps.add({Timestamp::from_seconds(t), T, interpolated}).T_odom_body;
  }
};

double off(const SE3& a, const SE3& b) { return (a.inverse() * b).log().norm(); }

TEST(OdometryLeaps, AStepBeyondAllSpeedsIsNoMotion) {
  for (const double metres : {0.6, 5.0, 60.0}) {
    Counter run;
    for (int i = 0; i < 200; ++i) {
      const double t = 0.05 * i;
      const SE3 leap = i < 100 ? SE3() : SE3::planar(metres, 0, 0);
      run.add(t, leap * drive(t));
      EXPECT_LT(off(run.last, drive(t)), 1e-6) << t;
    }
    ASSERT_EQ(run.leaps.leaps().size(), 1u);
    EXPECT_NEAR(run.leaps.leaps()[0].stamp.seconds(), 5, 1e-6);
    EXPECT_NEAR(run.leaps.leaps()[0].metres, metres, 0.05);
  }
}

TEST(OdometryLeaps, ACounterThatBeginsAtZeroAgainGoesOn) {
  Counter run;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.05 * i;
    run.add(t, i < 60 ? drive(t) : drive(3).inverse() * drive(t));
    EXPECT_LT(off(run.last, drive(t)), 1e-6) << t;
  }
  ASSERT_EQ(run.leaps.leaps().size(), 1u);
  EXPECT_TRUE(run.leaps.leaps()[0].to_origin);
}

// Readers interpolate poses at other sensors' times: one leap comes in parts.
TEST(OdometryLeaps, PosesInterpolatedInALeapAreOneLeap) {
  Counter run;
  for (int i = 0; i < 100; ++i) {
    const double t = 0.05 * i;
    const SE3 leap = SE3::planar(5, 0, 0);
    run.add(t, (i < 50 ? SE3() : leap) * drive(t));
    if (i == 49) {
      const SE3 between = SE3::interpolate(drive(t), leap * drive(t + 0.05), 0.4);
      run.add(t + 0.02, between, true);
    }
  }
  ASSERT_EQ(run.leaps.leaps().size(), 1u);
  EXPECT_LT(off(run.last, drive(0.05 * 99)), 1e-6);
}

TEST(OdometryLeaps, MotionsOfRobotsAreNone) {
  // Starts and stops at 3 m/s^2; one pose a second; stamps that come in bunches.
  Counter starts, slow, bunched;
  for (int i = 0; i < 100; ++i) {
    const double t = 0.05 * i, s = t < 1 ? 0 : t < 2 ? 1.5 * (t - 1) * (t - 1) : 1.5 + 3 * (t - 2);
    starts.add(t, SE3::planar(s, 0, 0));
    slow.add(i, SE3::planar(0.5 * i, 0, i % 7 == 0 ? 0.5 : 0));
    bunched.add(i < 50   ? 0.05 * i
                : i < 60 ? 3.5 + 0.001 * (i - 50)
                         : 0.05 * i + 0.6,
                drive(0.05 * i));
  }
  EXPECT_TRUE(starts.leaps.leaps().empty());
  EXPECT_TRUE(slow.leaps.leaps().empty());
  EXPECT_TRUE(bunched.leaps.leaps().empty());
}

// A line every 0.05 s, a count every 0.8 s: from standing and on the way.
TEST(OdometryLeaps, ACounterReadMoreOftenThanItCountsIsNoLeap) {
  Counter run;
  for (int i = 0; i < 400; ++i) {
    const double t = 0.05 * i;
    const double counted = 0.8 * std::floor(t / 0.8);
    run.add(t, drive(std::max(0.0, counted - 3)));
  }
  EXPECT_TRUE(run.leaps.leaps().empty());
  EXPECT_NEAR(run.leaps.counts_every(), 0.8, 1e-6);
  // Standing for seconds does not let a leap pass.
  Counter stands;
  for (int i = 0; i < 400; ++i) {
    const double t = 0.05 * i;
    stands.add(t, (t < 15 ? SE3() : SE3::planar(3, 0, 0)) * drive(std::min(t, 5.0)));
  }
  EXPECT_EQ(stands.leaps.leaps().size(), 1u);
  EXPECT_EQ(stands.leaps.counts_every(), 0);
}

TEST(OdometryLeaps, ACounterAtItsOriginAfterAHoleWasRestarted) {
  OdometryLeaps leaps;
  bool said = false;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.05 * i;
    if (t > 4 && t < 7) continue;
    const SE3 T = t < 5 ? drive(t) : drive(7).inverse() * drive(t);
    const Odometry one = leaps.add({Timestamp::from_seconds(t), T, false});
    said = said || one.restarted;
    EXPECT_EQ(one.restarted, said && leaps.leaps().size() == 1 && t < 7.04) << t;
  }
  EXPECT_TRUE(said);
  // The same hole where the counter counted on.
  OdometryLeaps none;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.05 * i;
    if (t > 4 && t < 7) continue;
    EXPECT_FALSE(none.add({Timestamp::from_seconds(t), drive(t), false}).restarted);
  }
  EXPECT_TRUE(none.leaps().empty());
}

// Recorded now and then, given between by interpolation: a counter as it is read, however seldom.
TEST(OdometryLeaps, SeldomRecordedIsNotReadTooOften) {
  OdometryLeaps seldom, often;
  for (int i = 0; i < 400; ++i) {
    const auto stamp = Timestamp::from_seconds(0.1 * i);
    seldom.add({stamp, SE3::planar(0.05 * i, 0, 0), i % 20 != 0});
    often.add({stamp, SE3::planar(0.5 * (i / 10), 0, 0), false});
  }
  EXPECT_EQ(seldom.counts_every(), 0);
  EXPECT_NEAR(often.counts_every(), 1, 0.01);
}

}  // namespace
}  // namespace lamina
