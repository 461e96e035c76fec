// Noise models at numbers worked by hand.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/sensors/noise.hpp>
#include <lamina/sensors/odometry.hpp>

namespace lamina {
namespace {

TEST(DepthNoise, KinectGrowsWithTheSquareOfDepth) {
  const DepthNoise noise = DepthNoise::kinect(525);
  EXPECT_NEAR(noise.sigma_depth(1), 1.425e-3, 1e-9);
  EXPECT_NEAR(noise.sigma_depth(3), 9 * 1.425e-3, 1e-9);
  EXPECT_NEAR(noise.quantisation(2), 4 * 2.85e-3, 1e-9);
  EXPECT_NEAR(noise.disparity_step, 0.125, 0.02);  // the device's eighth of a pixel
  // 0.8 m above a floor, 3 m away: 3.4 mm.
  EXPECT_NEAR(noise.sigma_height(3, 0.8), 3.42e-3, 1e-5);
  EXPECT_LT(noise.correlated_floor(3), noise.sigma_depth(3));
  EXPECT_GT(noise.correlated_floor(3), 0);
  EXPECT_EQ(noise.pixels_per_sample(), 9);
}

TEST(DepthNoise, StereoFollowsItsBaseline) {
  const DepthNoise wide = DepthNoise::bumblebee_xb3_wide();
  const DepthNoise narrow = DepthNoise::bumblebee_xb3_narrow();
  EXPECT_NEAR(wide.sigma_depth(5), 25.0 / (983 * 0.24) * 0.2, 1e-9);
  EXPECT_NEAR(narrow.sigma_depth(5), 2 * wide.sigma_depth(5), 1e-9);
  EXPECT_NEAR(wide.disparity(2), 983 * 0.24 / 2, 1e-9);
}

TEST(DepthNoise, NguyenIsFlatToSixtyDegreesAndGrowsBeyond) {
  EXPECT_NEAR(nguyen_sigma_depth(1.4, 0), 0.0012 + 0.0019, 1e-9);
  EXPECT_EQ(nguyen_sigma_depth(1.4, 0.5), nguyen_sigma_depth(1.4, 1.0));
  EXPECT_GT(nguyen_sigma_depth(1.4, 1.4), nguyen_sigma_depth(1.4, 1.2));
  EXPECT_NEAR(DepthNoise::kinect(525).sigma_lateral_px(0), 0.8, 1e-9);
}

TEST(OdometryModel, CovarianceGrowsWithTheWayAndIsNeverSingular) {
  const OdometryModel model;
  const Matrix6d still = increment_covariance(model, SE3());
  const Matrix6d metre = increment_covariance(model, SE3::planar(1, 0, 0));
  const Matrix6d turn = increment_covariance(model, SE3::planar(0, 0, 1));
  EXPECT_GT(still.diagonal().minCoeff(), 0);
  EXPECT_NEAR(std::sqrt(metre(0, 0)), 0.02, 1e-4);
  EXPECT_NEAR(std::sqrt(turn(5, 5)), 0.05, 1e-4);
  EXPECT_LT(metre(2, 2), metre(0, 0));
  EXPECT_LT(metre(3, 3), metre(5, 5));
}

}  // namespace
}  // namespace lamina
