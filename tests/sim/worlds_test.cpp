// The built-in worlds: what they contain, and that their robots measure it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include <lamina/models/error.hpp>
#include <lamina/sim/sim_recording.hpp>

namespace lamina::sim {
namespace {

using ::testing::HasSubstr;

std::string message_of(const std::string& name, const Parameters& parameters) {
  try {
    make_scene(name, parameters);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Worlds, UnknownNamesAndKeysSuggestTheNearest) {
  EXPECT_THAT(message_of("corridor_lop", {}), HasSubstr("perhaps corridor_loop"));
  EXPECT_THAT(message_of("hole", {{"hole.depht_m", "1"}}), HasSubstr("perhaps hole.depth_m"));
  EXPECT_THAT(message_of("hole", {{"hole.depth_m", "deep"}}), HasSubstr("a number"));
  EXPECT_THAT(message_of("hole", {{"camera.model", "kinetc"}}), HasSubstr("kinect, stereo, ideal"));
}

class EveryWorld : public ::testing::TestWithParam<std::string> {};

TEST_P(EveryWorld, MeasuresInTimeOrderAndSeesPlanes) {
  Simulation simulation(make_scene(GetParam()), 1);
  Timestamp last = Timestamp::from_nanoseconds(-1);
  int count = 0;
  std::int64_t returns = 0;
  while (auto measurement = simulation.next()) {
    EXPECT_LE(last, stamp_of(*measurement));
    last = stamp_of(*measurement);
    if (const auto* frame = std::get_if<DepthFrame>(&*measurement)) {
      for (std::uint16_t raw : frame->raw) returns += raw > 0 ? 1 : 0;
    } else if (const auto* scan = std::get_if<LaserScan>(&*measurement)) {
      for (std::size_t i = 0; i < scan->size(); ++i) returns += scan->valid(i) ? 1 : 0;
    }
    if (++count == 40) {
      break;
    }
  }
  EXPECT_GT(count, 20);
  EXPECT_GT(returns, 1000);
  EXPECT_LE(count, *simulation.size_hint());
}

std::vector<std::string> names() {
  std::vector<std::string> out;
  for (const auto& [name, description] : scene_list()) out.push_back(name);
  return out;
}

INSTANTIATE_TEST_SUITE_P(Builtin, EveryWorld, ::testing::ValuesIn(names()),
                         [](const auto& scene) { return scene.param; });

TEST(Worlds, ListHasTheAgreedNames) {
  const std::vector<std::string> all = names();
  for (const char* name : {"room", "flat", "steps", "plates", "obstacle_bed", "hole",
                           "hole_no_wall", "stairs_down", "corridor_loop", "office", "flyover",
                           "roof_ridge", "lost_altitude", "lost_roll", "long_corridor"}) {
    EXPECT_THAT(all, ::testing::Contains(name));
  }
}

TEST(Worlds, SameSeedSameMeasurements) {
  const auto first_frame = [](std::uint64_t seed) {
    Simulation simulation(make_scene("room"), seed);
    while (auto measurement = simulation.next()) {
      if (auto* frame = std::get_if<DepthFrame>(&*measurement)) return frame->raw;
    }
    return std::vector<std::uint16_t>();
  };
  EXPECT_EQ(first_frame(5), first_frame(5));
  EXPECT_NE(first_frame(5), first_frame(6));
}

TEST(Worlds, FlyoverSees54Planes) {
  Simulation simulation(make_scene("flyover"), 1);
  while (simulation.next()) {
  }
  int seen = 0;
  for (std::int64_t scans : simulation.sightings()) seen += scans >= 3 ? 1 : 0;
  EXPECT_EQ(seen, 54);
}

TEST(Worlds, CorridorLoopOdometryEndsMoreThanAMetreOff) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Simulation simulation(
        make_scene("corridor_loop", {{"camera.enabled", "off"}, {"lidar.enabled", "off"}}), seed);
    SE3 last_odometry;
    Timestamp last;
    while (auto measurement = simulation.next()) {
      const auto& odometry = std::get<Odometry>(*measurement);
      last_odometry = odometry.T_odom_body;
      last = odometry.stamp;
    }
    const SE3 truth = simulation.pose_at(last);
    EXPECT_GT((truth.translation() - last_odometry.translation()).norm(), 1.0) << seed;
  }
}

TEST(Worlds, LostAltitudeErrsBy50MetresAfterThreeGoodPoses) {
  Simulation simulation(make_scene("lost_altitude"), 1);
  std::vector<double> errors;
  while (auto measurement = simulation.next()) {
    if (const auto* odometry = std::get_if<Odometry>(&*measurement)) {
      errors.push_back(odometry->T_odom_body.translation().z() -
                       simulation.pose_at(odometry->stamp).translation().z());
    }
  }
  ASSERT_EQ(errors.size(), 13u);
  for (std::size_t i = 0; i < errors.size(); ++i) {
    EXPECT_NEAR(errors[i], i < 3 ? 0 : 50, 0.5) << i;
  }
}

}  // namespace
}  // namespace lamina::sim
