// Scene files: all kinds of things, and one mistake per rule.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include <lamina/models/error.hpp>
#include <lamina/sim/sim_recording.hpp>

namespace lamina::sim {
namespace {

using ::testing::HasSubstr;

class SceneFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("lamina_scene_" + std::to_string(getpid()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string write(const std::string& text, const std::string& name = "s.yaml") const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  std::string message_of(const std::string& text, const Parameters& parameters = {}) const {
    try {
      load_scene(write(text), parameters);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
  std::filesystem::path folder_;
};

const char* const kHall = R"(
name: hall
ground:
  - {name: floor, area: [-3, -3, 6, 3], openings: [{area: [2, -1, 3, 1]}], slab_m: 0.3}
walls:
  - {from: [6, -3], to: [6, 3], z: [0, 3]}
boxes:
  - {name: step, at: [1, 1, 0], yaw_deg: 20, size: [0.5, 0.5, 0.05], top: step}
ramps:
  - {at: [3.2, 1.5, 0], length: 1, width: 0.8, rise: 0.1}
houses:
  - {at: [4.5, -2], length: 1, width: 1, eaves: 1}
cylinders:
  - {base: [1, -2, 0], radius: 0.1, length: 1}
polygons:
  - {name: sheet, corners: [[0, 2, 0.5], [1, 2, 0.5], [1, 3, 0.8]]}
meshes:
  - {file: tent.obj, at: [0, -2, 0], scale: 0.5}
path: {points: [[0, 0], [1, 0]], speed: 0.5}
settings: {camera.height_m: 0.6, lidar.enabled: on}
)";

TEST_F(SceneFile, HoldsAllKindsOfThings) {
  write("v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\n", "tent.obj");
  World world = load_scene(write(kHall), {{"camera.height_m", "0.7"}});
  EXPECT_EQ(world.name, "hall");
  EXPECT_EQ(world.scene.hole_edges().size(), 4u);
  ASSERT_NE(world.scene.find("step.top"), nullptr);
  EXPECT_EQ(world.scene.find("step.top")->label, PlaneLabel::kStep);
  EXPECT_NEAR(world.scene.find("floor")->area, 9 * 6 - 2, 1e-9);
  EXPECT_EQ(world.scene.meshes().size(), 1u);
  EXPECT_NEAR(world.scene.meshes()[0].vertices_map[1].x(), 0.5, 1e-6);
  EXPECT_NEAR(world.rig.depth->camera.camera.T_body_camera.translation().z(), 0.7, 1e-12);
  EXPECT_TRUE(world.rig.lidar.has_value());
  Simulation simulation(std::move(world), 1);
  int frames = 0;
  while (auto measurement = simulation.next()) {
    frames += std::holds_alternative<DepthFrame>(*measurement) ? 1 : 0;
  }
  EXPECT_EQ(frames, 11);
  EXPECT_GT(simulation.hits()[0], 1000);
}

TEST_F(SceneFile, MistakesNameLineKeyAndTheNearestRightOne) {
  EXPECT_THAT(
      message_of("grond: []\n"),
      HasSubstr(
          "s.yaml:1: found unknown key \"grond\", expected a known one: did you mean 'ground'?"));
  EXPECT_THAT(message_of("ground:\n  - {area: [0, 0, 1]}\n"), HasSubstr("3 numbers, expected 4"));
  EXPECT_THAT(message_of("boxes:\n  - {size: big}\n"),
              HasSubstr("s.yaml:2: boxes[0]: found another value for size"));
  EXPECT_THAT(message_of("boxes:\n  - {at: [0, 0, 0]}\n"), HasSubstr("no key size"));
  EXPECT_THAT(message_of("boxes: 3\n"), HasSubstr("a list of mappings"));
  EXPECT_THAT(message_of("name: x\n"), HasSubstr("nothing to see"));
  EXPECT_THAT(message_of("ground: [\n"), HasSubstr("valid YAML"));
  EXPECT_THAT(message_of("ground:\n  - {area: [0, 0, 1, 1], label: flor}\n"),
              HasSubstr("floor, ramp"));
  EXPECT_THAT(message_of("ground:\n  - {area: [0, 0, 1, 1]}\nsettings: {camera.hight_m: 1}\n"),
              HasSubstr("did you mean 'camera.height_m'?"));
  EXPECT_THROW(load_scene((folder_ / "none.yaml").string()), Error);
  EXPECT_THROW(load_scene("no_such_scene"), Error);
}

}  // namespace
}  // namespace lamina::sim
