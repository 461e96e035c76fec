// Medians of noise over images.
#include <gtest/gtest.h>

#include <lamina/frontend/floor/noise_watch.hpp>

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

}  // namespace
}  // namespace lamina
