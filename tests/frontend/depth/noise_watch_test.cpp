// Medians of noise over images.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/frontend/depth/noise_watch.hpp>

namespace lamina {
namespace {

TEST(NoiseWatch, OfNothingIsOne) { EXPECT_EQ(NoiseWatch().median(), 1.0); }

TEST(NoiseWatch, MedianToFivePercent) {
  NoiseWatch watch;
  for (int k = 0; k < 10; ++k) watch.add(1);
  for (int k = 0; k < 15; ++k) watch.add(2.5);
  for (int k = 0; k < 3; ++k) watch.add(1e6);
  EXPECT_EQ(watch.images(), 28);
  EXPECT_NEAR(watch.median(), 2.5, 0.05 * 2.5);
}

TEST(NoiseWatch, WhatIsNoScaleIsNotCounted) {
  NoiseWatch watch;
  watch.add(0);
  watch.add(-1);
  EXPECT_EQ(watch.images(), 0);
}

// 1 mm rounds by 0.29 mm; an ideal sensor is off by 0.1 mm at 1 m, by 0.4 mm at 2 m.
TEST(NoiseWatch, RoundingIsNoNoiseOfTheSensor) {
  DepthFrame frame;
  frame.camera.noise = DepthNoise::ideal(525);
  frame.camera.depth_scale = 1000;
  EXPECT_EQ(raised_by_rounding(frame), 1);
  frame.raw.assign(1000, 1000);
  EXPECT_NEAR(raised_by_rounding(frame), std::hypot(1, 2.887), 0.001);
  frame.raw.assign(1000, 2000);
  EXPECT_NEAR(raised_by_rounding(frame), std::hypot(1, 0.722), 0.001);
}

}  // namespace
}  // namespace lamina
