// A body that turns now and then, wheels, and a sensor whose clock is off.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include <lamina/pipeline/calibration/clock_offset.hpp>

namespace lamina {
namespace {

// Every 8 s a turn of 2 s at 1 rad/s, left and right in turns, that begins and ends within 0.3 s.
double heading(double t) {
  const double cycle = std::floor(t / 8), in = t - 8 * cycle - 3;
  static constexpr double kRamp = 0.3, kTurn = 2;
  const auto ramp = [](double s) {  // integral of a rate that grows to 1 over kRamp
    const double c = std::clamp(s, 0.0, kRamp);
    return 0.5 * c * c / kRamp + std::max(0.0, s - kRamp);
  };
  const double turned = ramp(in) - ramp(in - kTurn);
  const bool left = static_cast<int>(cycle) % 2 == 0;
  return (left ? 1 : -1) * turned + (left ? 0 : kTurn);
}

struct Drive {
  TurnTrack wheels;
  ClockOffset sensor;
};

// Wheels at 20 Hz whose turns are 2 % wide and noisy; the sensor at 10 Hz to 1.5 mrad, stamped
// `delay` s late. `slip`: rad, by which the wheels are off at once, now and then.
Drive drive(double delay, double seconds = 60, unsigned seed = 1, double slip = 0) {
  Drive result;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  const auto at = [](double t) { return Timestamp::from_seconds(1000 + t); };
  double drift = 0;
  for (int i = 0; i * 0.05 < seconds; ++i) {
    const double t = 0.013 + 0.05 * i, turn = heading(t + 0.05) - heading(t);
    drift += 0.02 * std::abs(turn) * normal(random) + (slip != 0 && i % 97 == 50 ? slip : 0);
    result.wheels.add(at(t), SE3::planar(0, 0, 1.02 * heading(t) + drift));
  }
  double last = heading(0) + 0.0015 * normal(random);
  for (int i = 1; i * 0.1 < seconds; ++i) {
    const double yaw = heading(0.1 * i) + 0.0015 * normal(random);
    result.sensor.add(at(0.1 * (i - 1) + delay), at(0.1 * i + delay), yaw - last);
    last = yaw;
  }
  return result;
}

TEST(ClockOffset, IsFoundByTurns) {
  for (const double delay : {0.04, -0.07, 0.1, 0.2}) {
    const Drive all = drive(delay);
    const auto found = all.sensor.result(all.wheels);
    ASSERT_TRUE(found) << delay;
    EXPECT_NEAR(found->value, -delay, 0.003);
    EXPECT_LT(std::abs(found->value + delay), 4 * found->sigma);
    EXPECT_TRUE(found->is_significant());
  }
}

TEST(ClockOffset, IsNoneWhereThereIsNone) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Drive all = drive(0, 40, seed, seed % 2 == 0 ? 0 : 0.05);
    const auto found = all.sensor.result(all.wheels);
    ASSERT_TRUE(found);
    EXPECT_FALSE(found->is_significant());
    EXPECT_LT(std::abs(found->value), 0.006);
  }
}

// Wheels at 50 Hz whose noise is a random walk, a body that turns all the time at a rate that
// hardly changes: what changes from sample to sample is noise, and of an offset nothing tells.
TEST(ClockOffset, NoiseOfWheelsIsNoTurn) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, 1);
    const auto at = [](double t) { return Timestamp::from_seconds(1000 + t); };
    const auto yaw = [](double t) { return 0.3 * t + 0.4 * std::sin(0.5 * t); };
    TurnTrack wheels;
    ClockOffset sensor;
    double walk = 0, off = 0;
    for (int i = 0; i < 2000; ++i) {
      const double t = 0.02 * i;
      walk += 0.02 * std::sqrt(yaw(t + 0.02) - yaw(t)) * normal(random);
      wheels.add(at(t), SE3::planar(0, 0, yaw(t) + walk));
    }
    for (int i = 1; i < 400; ++i) {
      const double now = 0.0005 * normal(random);
      sensor.add(at(0.1 * (i - 1)), at(0.1 * i), yaw(0.1 * i) - yaw(0.1 * (i - 1)) + now - off);
      off = now;
    }
    const auto found = sensor.result(wheels);
    EXPECT_TRUE(!found || !found->is_significant())
        << seed << ": " << found->value << " +- " << found->sigma;
  }
}

TEST(ClockOffset, SlippingWheelsDoNotHideIt) {
  const Drive all = drive(0.04, 80, 1, 0.1);
  const auto found = all.sensor.result(all.wheels);
  ASSERT_TRUE(found && found->is_significant());
  EXPECT_NEAR(found->value, -0.04, 0.006);
}

TEST(ClockOffset, NothingTellsItWithoutTurns) {
  const Drive straight = drive(0.04, 2.8);
  EXPECT_FALSE(straight.sensor.result(straight.wheels));
  // One turn is a stretch, however clear.
  const Drive one = drive(0.04, 7);
  const auto found = one.sensor.result(one.wheels);
  EXPECT_TRUE(!found || !found->is_significant());
}

TEST(TurnTrack, IsUnwrappedAndHasHoles) {
  TurnTrack track;
  const auto at = [](double t) { return Timestamp::from_seconds(t); };
  track.add(at(1), SE3::planar(0, 0, 3.1));
  track.add(at(1.1), SE3::planar(0, 0, -3.1));
  track.add(at(2), SE3::planar(0, 0, -3.0));
  track.add(at(3), SE3::planar(0, 0, -3.0));
  ASSERT_TRUE(track.at(at(1.05)));
  EXPECT_NEAR(*track.at(at(1.05)), M_PI, 1e-9);
  EXPECT_FALSE(track.at(at(1.5)));  // it turned, at some time
  EXPECT_TRUE(track.at(at(2.5)));   // it stood
  EXPECT_FALSE(track.at(at(0.9)));
  EXPECT_FALSE(track.at(at(3.1)));
}

}  // namespace
}  // namespace lamina
