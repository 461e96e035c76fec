// Turns by images beside those of wheels: as they are, late, smeared, and with wheels that err.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <lamina/pipeline/calibration/turn_claims.hpp>

namespace lamina {
namespace {

const Timestamp kStart = Timestamp::from_seconds(1e9);

// Stands or drives straight for 4 s, turns by 1.6 rad within 2 s, and so on.
double heading(double t) {
  const double laps = std::floor(t / 6), within = t - 6 * laps;
  return 1.6 * (laps + std::clamp((within - 4) / 2, 0.0, 1.0));
}

struct World {
  double late = 0;        // s, of the images' stamps
  double smoothed = 0;    // s, time constant of a filter over them
  double wheel_turn = 1;  // of the true turn
  double slip = 0;        // rad, in the middle of every second turn
  double interval = 0.2;  // s, from image to image
  unsigned seed = 1;
};

struct Turns {
  TurnTrack wheels;
  TurnClaims claims;
};

// 40 s.
Turns drive(const World& world) {
  Turns turns;
  std::mt19937 random(world.seed);
  std::normal_distribution<double> wheel(0, 0.001), image(0, 0.003);
  double yaw = 0;
  for (double t = 0; t < 40; t += 0.05) {
    const double slipped = std::fmod(t, 12) > 5 && std::fmod(t - 0.05, 12) <= 5 ? world.slip : 0;
    yaw += world.wheel_turn * (heading(t) - heading(t - 0.05)) + slipped + wheel(random);
    turns.wheels.add(kStart + t, SE3(SO3::rot_z(yaw), Eigen::Vector3d::Zero()));
  }
  double shown = 0, last = 0;
  for (double t = world.interval; t < 40; t += world.interval) {
    const double share = world.smoothed > 0 ? 1 - std::exp(-world.interval / world.smoothed) : 1;
    shown += share * (heading(t - world.late) - shown);
    turns.claims.add(kStart + (t - world.interval), kStart + t, shown - last + image(random),
                     0.003);
    last = shown;
  }
  return turns;
}

TEST(TurnClaims, GoodImagesAreAsStated) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    World world;
    world.seed = seed;
    const Turns turns = drive(world);
    EXPECT_FALSE(turns.claims.found(turns.wheels)) << seed;
  }
}

TEST(TurnClaims, LateAndEarlyStampsAreFound) {
  for (const double late : {0.45, 0.2, 0.1, -0.3}) {
    World world;
    world.late = late;
    const Turns turns = drive(world);
    const auto found = turns.claims.found(turns.wheels);
    ASSERT_TRUE(found) << late;
    EXPECT_EQ(found->best.kind, TurnClaim::Kind::kOffset) << late;
    EXPECT_NEAR(found->best.value, -late, 0.01) << late;
  }
}

TEST(TurnClaims, AFilterOverImagesIsNoDelay) {
  for (const double time : {0.3, 0.6}) {
    World world;
    world.smoothed = time;
    const Turns turns = drive(world);
    const auto found = turns.claims.found(turns.wheels);
    ASSERT_TRUE(found) << time;
    EXPECT_TRUE(found->best.smeared()) << time;
  }
}

TEST(TurnClaims, WheelsThatTurnTooMuchOrSlipAreNoDelay) {
  for (const double turn : {0.8, 1.2}) {
    World world;
    world.wheel_turn = turn;
    const Turns turns = drive(world);
    EXPECT_FALSE(turns.claims.found(turns.wheels)) << turn;
  }
  for (const double slip : {0.5, -0.5}) {
    World world;
    world.slip = slip;
    const Turns turns = drive(world);
    EXPECT_FALSE(turns.claims.found(turns.wheels)) << slip;
  }
}

// One turn may be anything.
TEST(TurnClaims, TooFewTurnsSayNothing) {
  World world;
  world.late = 0.3;
  const Turns turns = drive(world);
  TurnTrack first;
  for (double t = 0; t < 8; t += 0.05) {
    first.add(kStart + t, SE3(SO3::rot_z(heading(t)), Eigen::Vector3d::Zero()));
  }
  EXPECT_FALSE(turns.claims.found(first));
}

}  // namespace
}  // namespace lamina
