// The built-in worlds: what they contain, and that their robots measure it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <lamina/models/error.hpp>
#include <lamina/sim/caster.hpp>
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
  EXPECT_THAT(message_of("corridor_lop", {}), HasSubstr("did you mean 'corridor_loop'?"));
  EXPECT_THAT(message_of("hole", {{"hole.depht_m", "1"}}),
              HasSubstr("did you mean 'hole.depth_m'?"));
  EXPECT_THAT(message_of("hole", {{"hole.depth_m", "deep"}}), HasSubstr("a number"));
  EXPECT_THAT(message_of("hole", {{"camera.model", "kinetc"}}), HasSubstr("kinect, stereo, ideal"));
}

TEST(Worlds, ASensorSwitchedOffKeepsItsKeysValid) {
  const World world = make_scene("room", {{"odometry.enabled", "false"},
                                          {"odometry.drift_deg_per_m", "0.5"},
                                          {"odometry.believed_sigma_rotation", "0.5"}});
  EXPECT_FALSE(world.rig.odometry);
  EXPECT_EQ(world.rig.assumed_odometry.sigma_rotation, OdometryModel{}.sigma_rotation);
  EXPECT_THAT(message_of("room", {{"odometry.enabled", "false"}, {"odometry.drfit", "1"}}),
              HasSubstr("odometry.drfit"));
  // Never there, and not switched off either: nobody reads it.
  EXPECT_THAT(message_of("room", {{"stereo.rate_hz", "2"}}), HasSubstr("stereo.rate_hz"));
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
  for (const char* name :
       {"room", "flat", "steps", "plates", "obstacle_bed", "hole", "hole_no_wall", "stairs_down",
        "corridor_loop", "office", "flyover", "roof_ridge", "lost_altitude", "lost_roll",
        "side_laser", "long_corridor"}) {
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

TEST(Worlds, SideLaserSeesGroundAndFacades) {
  Simulation simulation(make_scene("side_laser"), 1);
  while (simulation.next()) {
  }
  const auto scans = [&](const std::string& name) {
    const ScenePlane* plane = simulation.world().scene.find(name);
    return plane ? simulation.sightings()[static_cast<std::size_t>(plane->id)] : -1;
  };
  EXPECT_GT(scans("ground"), 500);
  int walls = 0;
  for (const ScenePlane& plane : simulation.world().scene.planes()) {
    const auto n = simulation.sightings()[static_cast<std::size_t>(plane.id)];
    walls += plane.name.rfind("house", 0) == 0 && n > 100 ? 1 : 0;
  }
  EXPECT_GE(walls, 4);
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

TEST(Worlds, StepsPlatesAndHoleHaveTheirStatedSizes) {
  const auto height = [](const World& world, const std::string& name) {
    const ScenePlane* plane = world.scene.find(name);
    return plane == nullptr ? -1 : plane->plane_map.rho();
  };
  const World steps = make_scene("steps");
  EXPECT_NEAR(height(steps, "platform.2cm.top"), 0.02, 1e-12);
  EXPECT_NEAR(height(steps, "platform.3cm.top"), 0.03, 1e-12);
  EXPECT_NEAR(height(steps, "platform.5cm.top"), 0.05, 1e-12);
  EXPECT_NEAR(height(steps, "platform.10cm.top"), 0.10, 1e-12);
  EXPECT_NEAR(steps.scene.find("ramp.slope")->plane_map.theta() * 180 / M_PI, 5, 1e-9);
  const World plates = make_scene("plates");
  EXPECT_NEAR(height(plates, "plate.1cm.4.top"), 0.01, 1e-12);
  EXPECT_NEAR(plates.scene.find("plate.2cm.0.top")->area, 0.04, 1e-12);
  const World hole = make_scene("hole");
  const ScenePlane* floor = hole.scene.find("floor");
  ASSERT_EQ(floor->holes_map.size(), 1u);
  EXPECT_EQ(hole.scene.hole_edges().size(), 4u);
  EXPECT_NE(hole.scene.find("wall"), nullptr);
  EXPECT_EQ(make_scene("hole_no_wall").scene.find("wall"), nullptr);
}

TEST(Worlds, AnUnevenFloorCarriesTheBody) {
  Simulation simulation(make_scene("uneven", {{"camera.enabled", "off"}}), 1);
  const Caster caster(simulation.world().scene);
  double highest = 0, steepest = 0, off = 0;
  for (double time = 0; time < simulation.world().path.duration(); time += 0.5) {
    const SE3 T = simulation.world().path.at(time);
    double ground = 0;
    for (const double x : {-0.2, 0.2}) {
      for (const double y : {-0.15, 0.15}) {
        const Eigen::Vector3d wheel = T * Eigen::Vector3d(x, y, 0);
        const auto down = caster.cast({wheel.x(), wheel.y(), 1}, {0, 0, -1});
        ASSERT_TRUE(down.has_value());
        ground += (1 - down->range) / 4;
      }
    }
    off = std::max(off, std::abs(T.translation().z() - ground));
    highest = std::max(highest, std::abs(T.translation().z()));
    steepest = std::max(steepest, std::acos(T.so3().matrix()(2, 2)));
  }
  EXPECT_LT(off, 5e-4);
  EXPECT_GT(highest, 0.008);
  EXPECT_LT(highest, 0.04);
  EXPECT_GT(steepest, 0.01);
  const Scene& scene = simulation.world().scene;
  EXPECT_EQ(std::count_if(scene.planes().begin(), scene.planes().end(),
                          [](const ScenePlane& p) { return p.label == PlaneLabel::kFloor; }),
            1);
}

TEST(Worlds, BothSidesOfTheRoofAreSeen) {
  for (const char* off : {"0", "2"}) {
    Simulation simulation(make_scene("roof_ridge", {{"ridge.off_deg", off}}), 1);
    while (simulation.next()) {
    }
    for (const char* side : {"house.roof.left", "house.roof.right"}) {
      const ScenePlane* roof = simulation.world().scene.find(side);
      ASSERT_NE(roof, nullptr);
      EXPECT_GT(simulation.sightings()[static_cast<std::size_t>(roof->id)], 10) << side << off;
    }
  }
}

TEST(Worlds, LostRollErrsBy22DegreesAfterThreeGoodPoses) {
  Simulation simulation(make_scene("lost_roll"), 1);
  int index = 0;
  while (auto measurement = simulation.next()) {
    if (const auto* odometry = std::get_if<Odometry>(&*measurement)) {
      const SO3 error =
          simulation.pose_at(odometry->stamp).so3().inverse() * odometry->T_odom_body.so3();
      EXPECT_NEAR(error.log().norm() * 180 / M_PI, index++ < 3 ? 0 : 22, 1.0);
    }
  }
  EXPECT_EQ(index, 13);
}

TEST(Simulation, AccelerometerAtRestFeelsGravity) {
  Simulation simulation(make_scene("flat", {{"path.advance_m", "0"},
                                            {"path.duration_s", "2"},
                                            {"camera.enabled", "off"},
                                            {"accelerometer.enabled", "on"}}),
                        1);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  int count = 0;
  while (auto measurement = simulation.next()) {
    if (const auto* a = std::get_if<Accelerometer>(&*measurement)) {
      mean += a->acceleration_body;
      ++count;
    }
  }
  ASSERT_EQ(count, 101);
  EXPECT_LT((mean / count - Eigen::Vector3d(0, 0, 9.81)).norm(), 0.03);
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
