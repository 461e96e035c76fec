// Which preset a recording gets, and what goes over it.
#include <lamina/pipeline/config/preset.hpp>

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include <lamina/models/error.hpp>
#include <lamina/pipeline/config/map_request.hpp>

namespace lamina {
namespace {

constexpr double kMaxTilt = 0.5;

Calibration with_lidar(const SO3& R_body_lidar) {
  Calibration calibration;
  calibration.lidar = LidarModel{{}, SE3(R_body_lidar, {0, 0, 0.3})};
  return calibration;
}

TEST(Preset, FollowsTheSensors) {
  EXPECT_EQ(preset_for(Calibration{}, kMaxTilt).name, "indoor_rgbd");
  Calibration camera;
  camera.depth_camera.emplace();
  EXPECT_EQ(preset_for(camera, kMaxTilt).name, "indoor_rgbd");
  EXPECT_EQ(preset_for(with_lidar(SO3()), kMaxTilt).name, "wheeled_lidar");
  const SO3 upside_down = SO3::exp({M_PI, 0, 0}), down = SO3::exp({0, M_PI / 2, 0});
  EXPECT_EQ(preset_for(with_lidar(upside_down), kMaxTilt).name, "wheeled_lidar");
  EXPECT_EQ(preset_for(with_lidar(down), kMaxTilt).name, "aerial_lidar");
}

TEST(Preset, EveryOneIsOfKnownKeysAndHasNoProblems) {
  ASSERT_EQ(presets().size(), 3u);
  for (const Preset& preset : presets()) {
    MapOptions settings;
    apply(preset, settings);
    EXPECT_TRUE(problems(settings).empty()) << preset.name;
    EXPECT_EQ(settings.preset, preset.name);
    EXPECT_EQ(find_preset(preset.name), &preset);
  }
  EXPECT_EQ(find_preset("auto"), nullptr);
}

TEST(Preset, WhatTheUserSaysGoesOverIt) {
  const Calibration down = with_lidar(SO3::exp({0, M_PI / 2, 0}));
  MapRequest request;
  EXPECT_EQ(options_of(request, &down).tracking.min_observations, 1);
  request.assignments = {"tracking.min_observations=4"};
  EXPECT_EQ(options_of(request, &down).tracking.min_observations, 4);
  EXPECT_EQ(options_of(request, &down).preset, "aerial_lidar");
  request.assignments.clear();
  request.preset = "indoor_rgbd";
  EXPECT_EQ(options_of(request, &down).tracking.min_observations,
            MapOptions{}.tracking.min_observations);
  request.preset = "indor_rgbd";
  EXPECT_THROW(options_of(request, &down), Error);
}

TEST(Preset, SettingsWrittenAndReadAgainAreTheSame) {
  const Calibration down = with_lidar(SO3::exp({0, M_PI / 2, 0}));
  MapRequest request;
  const std::string yaml = to_yaml(options_of(request, &down), true);
  const auto file = std::filesystem::temp_directory_path() / "lamina_preset_test.yaml";
  std::ofstream(file) << yaml;
  request.config = file;
  // Whatever the sensors suggest: the file names its preset.
  const Calibration level = with_lidar(SO3());
  EXPECT_EQ(to_yaml(options_of(request, &level), true), yaml);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace lamina
