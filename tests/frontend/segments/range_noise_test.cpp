// A scanner noisier than stated is known by its scans.
#include <gtest/gtest.h>

#include <lamina/frontend/segments/range_noise.hpp>

#include "frontend/segments/scan_maker.hpp"

namespace lamina {
namespace {
using test::ScanMaker;

// The sigma in use after some scans of furnished-like polygons.
double sigma_after(double real, double stated, int beams, int corners, double range_max = 30) {
  ScanMaker maker;
  maker.beams = beams;
  maker.noise.range_sigma = real;
  maker.range_max = range_max;
  std::mt19937 random(5);
  RangeNoise noise;
  for (int k = 0; k < 40; ++k) {
    LaserScan scan = maker.scan(test::random_polygon(random, corners, 1, 8), random);
    scan.lidar.noise.range_sigma = stated;
    noise.update(scan);
  }
  return noise.sigma();
}

TEST(RangeNoise, StatedNoiseStays) {
  for (const int beams : {181, 541}) {
    EXPECT_EQ(sigma_after(0.01, 0.01, beams, 6), 0.01) << beams;
    EXPECT_EQ(sigma_after(0.002, 0.01, beams, 6), 0.01) << beams;
    EXPECT_EQ(sigma_after(0.013, 0.01, beams, 6), 0.01) << beams;
  }
}

TEST(RangeNoise, ANoisierScannerTellsHowNoisyItIs) {
  for (const int beams : {181, 541, 1081}) {
    for (const double real : {0.02, 0.03, 0.05}) {
      EXPECT_NEAR(sigma_after(real, 0.01, beams, 6), real, 0.1 * real) << beams;
    }
  }
}

// Loggers write 0.1 m for any scanner.
TEST(RangeNoise, AStatedNoiseFarAboveWhatScansShowIsLowered) {
  for (const int beams : {181, 541}) {
    EXPECT_NEAR(sigma_after(0.02, 0.1, beams, 6), 0.02, 0.004) << beams;
    EXPECT_EQ(sigma_after(0.003, 0.1, beams, 6), 0.01) << beams;  // no better than usual
    EXPECT_EQ(sigma_after(0.04, 0.1, beams, 6), 0.1) << beams;    // not far from it
  }
}

TEST(RangeNoise, ClutterIsNoNoise) {
  EXPECT_EQ(sigma_after(0.01, 0.01, 541, 40), 0.01);
  EXPECT_NEAR(sigma_after(0.05, 0.01, 541, 40), 0.05, 0.01);
}

TEST(RangeNoise, NothingSeenTellsNothing) { EXPECT_EQ(sigma_after(0.05, 0.01, 541, 6, 0.5), 0.01); }

TEST(RangeNoise, GoesBackWhereScansDo) {
  ScanMaker maker;
  std::mt19937 random(5);
  RangeNoise noise;
  EXPECT_EQ(noise.sigma(), 0);
  for (int k = 0; k < 120; ++k) {
    maker.noise.range_sigma = k < 60 ? 0.05 : 0.01;
    LaserScan scan = maker.scan(test::room(6, 4, 2, 1.5, 0.1 * k), random);
    scan.lidar.noise.range_sigma = 0.01;
    noise.update(scan);
    if (k == 59) {
      EXPECT_NEAR(noise.sigma(), 0.05, 0.005);
    }
  }
  EXPECT_EQ(noise.sigma(), 0.01);
}

// Rough surroundings for a while are no other scanner.
TEST(RangeNoise, IsSteady) {
  ScanMaker maker;
  std::mt19937 random(5);
  RangeNoise noise;
  for (int k = 0; k < 200; ++k) {
    maker.noise.range_sigma = k < 140 ? 0.03 : 0.045;
    LaserScan scan = maker.scan(test::room(6, 4, 2, 1.5, 0.1 * k), random);
    scan.lidar.noise.range_sigma = 0.01;
    noise.update(scan);
  }
  EXPECT_NEAR(noise.sigma(), 0.03, 0.004);
}

}  // namespace
}  // namespace lamina
