// The option table: reading, writing, and what it says of mistakes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include <lamina/models/error.hpp>
#include <lamina/pipeline/config/setting_ranges.hpp>
#include <lamina/pipeline/config/settings.hpp>

namespace lamina {
namespace {

std::string message_of(const std::string& assignment) {
  MapOptions settings;
  try {
    set_assignment(settings, assignment);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

std::filesystem::path temporary(const std::string& content) {
  const auto file = std::filesystem::temp_directory_path() /
                    (std::string("lamina_settings_") +
                     testing::UnitTest::GetInstance()->current_test_info()->name() + ".yaml");
  std::ofstream(file) << content;
  return file;
}

TEST(Settings, KeysThatTheContractFixesExist) {
  for (const char* key : {"grid.resolution_m", "robot.height_m", "robot.radius_m",
                          "robot.max_step_m", "robot.max_slope_deg", "floor.sections",
                          "floor.roi_m", "window.keyframes", "checkpoint.interval_s"}) {
    bool found = false;
    for (const Setting& setting : setting_table()) found = found || setting.key == key;
    EXPECT_TRUE(found) << key;
  }
}

TEST(Settings, DefaultsHaveNoProblems) { EXPECT_THAT(problems(MapOptions{}), testing::IsEmpty()); }

TEST(Settings, ProblemsHoldRangesToo) {
  MapOptions settings;
  settings.grid_resolution = 20;
  EXPECT_THAT(problems(settings), testing::ElementsAre("grid.resolution_m: found '20', expected a "
                                                       "number from 0.005 to 10"));
}

TEST(Settings, YamlGoesRoundForEveryKey) {
  MapOptions settings;
  set_assignment(settings, "robot.height_m=1.25");
  set_assignment(settings, "robot.max_slope_deg=7");
  const std::string yaml = to_yaml(settings, true);
  MapOptions back;
  load(back, temporary(yaml));
  EXPECT_EQ(to_yaml(back, true), yaml);
  EXPECT_DOUBLE_EQ(back.robot.height, 1.25);
  EXPECT_NEAR(back.robot.max_slope, 7 * M_PI / 180, 1e-15);
}

TEST(Settings, EveryNumberHasARangeThatIsKept) {
  const MapOptions defaults;
  int numbers = 0;
  for (const Setting& setting : setting_table()) {
    double value = 0;
    try {
      text::read(setting.write(defaults), value);
    } catch (const std::invalid_argument&) {
      continue;
    }
    if (setting.key == "seed") continue;
    ++numbers;
    const auto range = range_of(setting.key);
    ASSERT_TRUE(range) << setting.key;
    EXPECT_GE(value, range->low) << setting.key;
    EXPECT_LE(value, range->high) << setting.key;
    for (const double wrong : {range->low - 1, 2 * range->high + 1}) {
      const std::string text = text::write(wrong);
      EXPECT_THAT(
          message_of(setting.key + "=" + text),
          testing::HasSubstr(setting.key + ": found '" + text + "', expected a number from"))
          << setting.key;
    }
  }
  EXPECT_GE(numbers, 40);
  EXPECT_THAT(message_of("floor.sections=[4, 0]"), testing::HasSubstr("from 1 to 100"));
}

TEST(Settings, OneSwitchTurnsSelfCalibrationOff) {
  MapOptions settings;
  set_assignment(settings, "lidar.find_sweep=false");
  set_assignment(settings, "self_calibration.enabled=true");
  EXPECT_TRUE(settings.calibrate_wheels);
  EXPECT_FALSE(settings.find_sweep);
  set_assignment(settings, "self_calibration.enabled=false");
  EXPECT_FALSE(settings.find_clocks || settings.calibrate_depth || settings.calibrate_wheels ||
               settings.calibrate_mountings || settings.floor.self_calibrate);
}

TEST(Settings, FormerNamesAreStillRead) {
  MapOptions options;
  set_assignment(options, "scan.range_max_m=7");
  set_assignment(options, "wheels.images=false");
  EXPECT_EQ(options.former_names.size(), 2U);
  EXPECT_EQ(options.scan.range_max_m, 7);
  EXPECT_FALSE(options.images_beside_wheels);
  EXPECT_NE(to_yaml(options, false).find("obstacles:"), std::string::npos);
}

TEST(Settings, UnknownKeysSuggestTheNearest) {
  EXPECT_EQ(message_of("robot.hight_m=1"),
            "--set: unknown key 'robot.hight_m': did you mean 'robot.height_m'?");
  EXPECT_THAT(message_of("nonsense=1"), testing::HasSubstr("lamina config --defaults"));
}

TEST(Settings, WrongValuesSayWhatWasExpected) {
  EXPECT_EQ(message_of("robot.height_m=tall"),
            "--set: robot.height_m: found 'tall', expected a number");
  EXPECT_EQ(message_of("robot.height_m=nan"),
            "--set: robot.height_m: found 'nan', expected a finite number");
  EXPECT_EQ(message_of("robot.height_m"), "--set: found 'robot.height_m', expected key=value");
}

TEST(Settings, FilesAreNamedWithTheLine) {
  MapOptions settings;
  const auto file = temporary("robot:\n  height_m: 1\n  radios_m: 2\n");
  try {
    load(settings, file);
    FAIL() << "expected an error";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()), file.string() +
                                             ":3: unknown key 'robot.radios_m': did you "
                                             "mean 'robot.radius_m'?");
  }
}

}  // namespace
}  // namespace lamina
