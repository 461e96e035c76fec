// What a run says of itself at its end.
#include <gtest/gtest.h>

#include <lamina/pipeline/calibration/camera/camera_checks.hpp>
#include <lamina/pipeline/diagnostics.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

std::vector<Warning> doubts_of(double open_images, double open_way) {
  const FrontEnd front_end({}, {});
  Diagnostics metrics;
  metrics.counts.steps = 1000;
  metrics.counts.steps_with_open_direction = open_images;
  metrics.counts.open_direction_longest_m = open_way;
  return result_warnings("recording", front_end, metrics);
}

TEST(Doubts, ALongWayAlongABareWallIsTold) {
  const auto observed = doubts_of(150, 1.3);
  ASSERT_EQ(observed.size(), 1U);
  EXPECT_NE(observed[0].text.find("open over 1.3 m of way in a row"), std::string::npos)
      << observed[0].text;
}

TEST(Doubts, ShortGlancesAreNot) { EXPECT_TRUE(doubts_of(150, 0.3).empty()); }

TEST(Doubts, MostImagesOpenIsToldOnce) {
  const auto observed = doubts_of(800, 5);
  ASSERT_EQ(observed.size(), 1U);
  EXPECT_EQ(observed[0].id, "images_open_direction");
  EXPECT_NE(observed[0].text.find("800 of 1000 images"), std::string::npos) << observed[0].text;
}

TEST(Doubts, ScansAloneInABareCorridorAreTold) {
  const FrontEnd front_end({}, {});
  Diagnostics metrics;
  metrics.counts.steps = 1000;
  metrics.counts.scans_with_open_direction = 100;
  metrics.counts.scans_open_direction_longest_m = 6.2;
  const auto observed = result_warnings("recording", front_end, metrics);
  ASSERT_EQ(observed.size(), 1U);
  EXPECT_NE(observed[0].text.find("100 scans left a direction"), std::string::npos)
      << observed[0].text;
  EXPECT_NE(observed[0].text.find("over 6.2 m of way in a row"), std::string::npos)
      << observed[0].text;
  metrics.counts.scans_open_direction_longest_m = 0.4;
  EXPECT_TRUE(result_warnings("recording", front_end, metrics).empty());
}

TEST(Doubts, AWayByWheelsAloneIsToldWhereItMatters) {
  const FrontEnd front_end({}, {});
  Diagnostics metrics;
  metrics.counts.steps = 1000;
  metrics.counts.path_m = 52;
  metrics.counts.by_wheels_alone_m = 48;
  metrics.counts.way_by_wheels_alone_m = 47;
  metrics.counts.heading_by_wheels_alone_m = 30;
  metrics.counts.by_wheels_alone_sigma_m = 1.3;
  const auto observed = result_warnings("recording", front_end, metrics);
  ASSERT_EQ(observed.size(), 1U);
  EXPECT_NE(observed[0].text.find("wheels alone told 48 of 52 m"), std::string::npos)
      << observed[0].text;
  EXPECT_NE(observed[0].text.find("off by some 1.3 m"), std::string::npos) << observed[0].text;
  metrics.counts.by_wheels_alone_sigma_m = 0.1;
  EXPECT_TRUE(result_warnings("recording", front_end, metrics).empty());
}

TEST(Doubts, AFloorWhoseStepsCannotBeToldIs) {
  const FrontEnd front_end({}, {});
  Diagnostics metrics;
  metrics.counts.steps = 1000;
  metrics.counts.cells_free = 1000;
  metrics.counts.cells_step_open = 3000;
  const auto observed = result_warnings("recording", front_end, metrics);
  ASSERT_EQ(observed.size(), 1U);
  EXPECT_NE(observed[0].text.find("(robot.max_step_m) cannot be told on 75 % of the floor"),
            std::string::npos)
      << observed[0].text;
  metrics.counts.cells_step_open = 900;
  EXPECT_TRUE(result_warnings("recording", front_end, metrics).empty());
}

// A slip of some decimetres along it passed without a word.
TEST(Doubts, ALongStretchByWheelsAloneIsNamed) {
  const FrontEnd front_end({}, {});
  Diagnostics metrics;
  metrics.counts.steps = 1000;
  metrics.counts.path_m = 60;
  metrics.counts.by_wheels_alone_m = 26;
  metrics.counts.by_wheels_alone_sigma_m = 0.09;
  metrics.counts.way_by_wheels_alone_longest_m = 25;
  metrics.counts.way_by_wheels_alone_longest_from_s = 1012.25;
  metrics.counts.way_by_wheels_alone_longest_to_s = 1054;
  const auto observed = result_warnings("recording", front_end, metrics);
  ASSERT_EQ(observed.size(), 1U);
  EXPECT_NE(observed[0].text.find("from 1012.2 to 1054.0 s nothing but wheels"), std::string::npos)
      << observed[0].text;
  EXPECT_NE(observed[0].text.find("over 25.0 m"), std::string::npos) << observed[0].text;
  EXPECT_NE(observed[0].text.find("all that follows 0.5 m off"), std::string::npos)
      << observed[0].text;
  metrics.counts.way_by_wheels_alone_longest_m = 12;
  EXPECT_TRUE(result_warnings("recording", front_end, metrics).empty());
}

// What is said of a dozen images alike from one place, of a room's floor and end.
std::vector<Warning> doubts_of_images(DepthFrame frame) {
  FrontEnd front_end({}, {});
  Diagnostics metrics;
  for (int k = 0; k < 12; ++k) {
    frame.stamp = Timestamp::from_seconds(1 + 0.1 * k);
    Odometry odometry;
    odometry.stamp = frame.stamp;
    front_end.process(odometry, metrics);
    front_end.process(frame, metrics);
  }
  metrics.counts.steps = 12;
  return result_warnings("recording", front_end, metrics);
}

DepthFrame room_image(double sigma_px) {
  return testing::draw({testing::floor_piece(), testing::wall_piece(2.5)},
                       testing::small_test_camera(0.4), sigma_px);
}

TEST(Doubts, ImagesAsTheirCalibrationSaysAreNotDoubted) {
  EXPECT_TRUE(doubts_of_images(room_image(0.05)).empty());
}

TEST(Doubts, NoiseFarAboveTheModelIsTold) {
  const auto observed = doubts_of_images(room_image(0.2));
  ASSERT_EQ(observed.size(), 1U);
  EXPECT_NE(observed[0].text.find("noise of depth images is "), std::string::npos)
      << observed[0].text;
  EXPECT_NE(observed[0].text.find(" times what calibration.yaml says"), std::string::npos)
      << observed[0].text;
}

TEST(Doubts, AMountingThatTurnsNothingWhileTheFloorLiesBelowAnOpticalFrameIsTold) {
  DepthFrame frame = room_image(0.05);
  frame.camera.camera.T_body_camera = SE3();
  const auto observed = doubts_of_images(frame);
  ASSERT_EQ(observed.size(), 1U);
  EXPECT_NE(observed[0].text.find(
                "0 of 12 images show a floor so, 12 if it looks ahead, 0.80 m below it"),
            std::string::npos)
      << observed[0].text;
  EXPECT_NE(observed[0].text.find("[-0.5, 0.5, -0.5, 0.5]"), std::string::npos);
}

// A camera that looks up at a ceiling by its mounting.
TEST(Doubts, ACameraThatLooksUpIsNotDoubted) {
  DepthFrame frame = testing::draw(
      {{Plane({0, 0, -1}, -2.5)}},
      [] {
        DepthCamera camera = testing::small_test_camera(0);
        camera.camera.T_body_camera = SE3();
        return camera;
      }(),
      0.05);
  EXPECT_TRUE(doubts_of_images(frame).empty());
}

// Stretched depth never turns the floor, a body that pitches leaves it where it is.
TEST(FloorScatter, GroundThatSwellsIsNoStretchedDepth) {
  const auto said = [](double height, double degrees) {
    MountingVerdict verdict;
    verdict.height_scatter = height;
    verdict.tilt_scatter = degrees * M_PI / 180;
    return floor_scatter_warning(verdict, true).id;
  };
  EXPECT_EQ(said(0.06, 0.02), "depth_stretched");
  EXPECT_EQ(said(0.025, 1.7), "floor_uneven");
  EXPECT_EQ(said(0.0005, 2.5), "body_pitch");
  EXPECT_EQ(said(0.0005, 0.02), "");
}

}  // namespace
}  // namespace lamina
