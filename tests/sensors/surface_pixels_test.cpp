// Pixels that show no surface.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include <lamina/sensors/surface_pixels.hpp>

namespace lamina {
namespace {

// A floor seen from 1 m above at a slant, with the noise of a Kinect times `noisy`.
DepthFrame floor_image(double noisy, std::mt19937& random) {
  DepthFrame frame;
  CameraModel& model = frame.camera.camera;
  model.width = 160, model.height = 120;
  model.fx = model.fy = 130, model.cx = 80, model.cy = 60;
  frame.camera.depth_scale = 1000;
  frame.camera.noise = DepthNoise::kinect(130);
  std::normal_distribution<double> normal;
  for (int v = 0; v < 120; ++v) {
    for (int u = 0; u < 160; ++u) {
      const double z = 1 / (0.2 + (v - 60) / 130.0);
      const double seen = z + noisy * frame.camera.noise.sigma_depth(z) * normal(random);
      frame.raw.push_back(z > 0 && z < 8 ? static_cast<std::uint16_t>(1000 * seen) : 0);
    }
  }
  return frame;
}

std::size_t seen(const DepthFrame& frame, int first_row, int last_row) {
  const auto begin = frame.raw.begin() + first_row * frame.width();
  return static_cast<std::size_t>(std::count_if(begin, frame.raw.begin() + last_row * frame.width(),
                                                [](auto raw) { return raw != 0; }));
}

TEST(SurfacePixels, AllOfAFloorStaysAlsoWhereItsNoiseIsTwiceTheStated) {
  std::mt19937 random(1);
  for (const double noisy : {0.0, 1.0, 2.0}) {
    DepthFrame frame = floor_image(noisy, random);
    const auto before = frame.raw;
    EXPECT_EQ(leave_surfaces(frame).pixels, 0) << noisy;
    EXPECT_EQ(frame.raw, before);
  }
}

TEST(SurfacePixels, RowsOfNoiseGoAndTheRestStays) {
  std::mt19937 random(2);
  DepthFrame frame = floor_image(1, random);
  const std::size_t floor = seen(frame, 56, 80);
  std::uniform_int_distribution<int> anything(500, 6000);
  for (int i = 80 * 160; i < 120 * 160; ++i)
    frame.raw[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(anything(random));
  const PixelsLeftOut out = leave_surfaces(frame);
  EXPECT_EQ(seen(frame, 80, 120), 0u);
  EXPECT_EQ(seen(frame, 56, 80), floor);
  EXPECT_EQ(out.first_row, 80);
  EXPECT_EQ(out.last_row, 119);
  EXPECT_EQ(out.pixels, 40 * 160);
}

// As with every option: a half more or less changes nothing here.
TEST(SurfacePixels, OptionsMayMoveByAHalf) {
  for (const double by : {0.5, 1.5}) {
    for (int which = 0; which < 4; ++which) {
      std::mt19937 random(3);
      SurfacePixelsOptions options;
      if (which == 0) options.block = static_cast<int>(by * options.block);
      if (which == 1) options.sigmas *= by;
      if (which == 2) options.near *= by;
      if (which == 3) options.share *= by;
      DepthFrame frame = floor_image(1, random);
      EXPECT_LT(leave_surfaces(frame, options).pixels, 0.02 * 160 * 120) << which << " " << by;
      std::uniform_int_distribution<int> anything(500, 6000);
      for (auto& raw : frame.raw) raw = static_cast<std::uint16_t>(anything(random));
      EXPECT_GT(leave_surfaces(frame, options).pixels, 0.9 * 160 * 120) << which << " " << by;
    }
  }
}

}  // namespace
}  // namespace lamina
