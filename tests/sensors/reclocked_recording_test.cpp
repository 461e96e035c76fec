// A list of measurements as a recording, read with other clocks.
#include <gtest/gtest.h>

#include <vector>

#include <lamina/sensors/reclocked_recording.hpp>

#include "support/listed_recording.hpp"

namespace lamina {
namespace {

Timestamp at(double t) { return Timestamp::from_seconds(100 + t); }

LaserScan scan(double t) {
  LaserScan s;
  s.stamp = at(t);
  return s;
}
DepthFrame image(double t) {
  DepthFrame d;
  d.stamp = at(t);
  return d;
}
Odometry odometry(double t, double x) { return {at(t), SE3::planar(x, 0, 0), false}; }

std::vector<Measurement> read(std::vector<Measurement> all, const ClockOffsets& offsets) {
  ReclockedRecording recording(std::make_unique<testing::ListedRecording>(std::move(all)), offsets);
  std::vector<Measurement> out;
  while (auto m = recording.next()) out.push_back(std::move(*m));
  return out;
}

TEST(ReclockedRecording, PutsMovedStampsInOrderBehindOdometryOfTheirTime) {
  const auto out = read(
      {odometry(0, 0), image(0.08), scan(0.1), odometry(0.1, 1), odometry(0.2, 2)}, {-0.04, 0});
  ASSERT_EQ(out.size(), 6);
  const auto* met = std::get_if<Odometry>(&out[1]);
  ASSERT_TRUE(met);
  EXPECT_EQ(met->stamp, at(0.06));
  EXPECT_NEAR(met->T_odom_body.translation().x(), 0.6, 1e-9);
  ASSERT_TRUE(std::holds_alternative<LaserScan>(out[2]));
  EXPECT_EQ(stamp_of(out[2]), at(0.06));
  EXPECT_TRUE(std::holds_alternative<DepthFrame>(out[3]));
  for (std::size_t i = 1; i < out.size(); ++i) EXPECT_GE(stamp_of(out[i]), stamp_of(out[i - 1]));
}

TEST(ReclockedRecording, EarlyStampsWaitForWhatComesBeforeThem) {
  const auto out =
      read({odometry(0, 0), image(0.01), scan(0.02), odometry(0.1, 1), scan(0.2)}, {0, 0.05});
  ASSERT_EQ(out.size(), 6);
  EXPECT_TRUE(std::holds_alternative<LaserScan>(out[1]));
  EXPECT_TRUE(std::holds_alternative<Odometry>(out[2]));
  ASSERT_TRUE(std::holds_alternative<DepthFrame>(out[3]));
  EXPECT_EQ(stamp_of(out[3]), at(0.06));
}

TEST(ReclockedRecording, BeforeTheFirstOdometryItsMotionIsCarriedBack) {
  const auto out = read({odometry(0, 0), scan(0.02), odometry(0.1, 1), scan(0.12)}, {-0.04, 0});
  ASSERT_EQ(out.size(), 6);
  const auto* met = std::get_if<Odometry>(&out[0]);
  ASSERT_TRUE(met);
  EXPECT_EQ(met->stamp, at(-0.02));
  EXPECT_NEAR(met->T_odom_body.translation().x(), -0.2, 1e-9);
  EXPECT_TRUE(std::holds_alternative<LaserScan>(out[1]));
}

TEST(ReclockedRecording, NothingIsMetInAHoleOrBeyondTheOdometry) {
  const auto out = read({odometry(0, 0), scan(1), odometry(2, 1), scan(2.5)}, {-0.04, 0});
  ASSERT_EQ(out.size(), 4);
  EXPECT_TRUE(std::holds_alternative<LaserScan>(out[1]));
  EXPECT_TRUE(std::holds_alternative<LaserScan>(out[3]));
}

}  // namespace
}  // namespace lamina
