// The bend of a depth image: what planes tell of it, and its removal.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <lamina/frontend/floor/distortion_estimator.hpp>
#include <lamina/models/error.hpp>

#include "depth_scene.hpp"

namespace lamina {
namespace {

constexpr int kWidth = 160, kHeight = 120;

DepthDistortion bent(double u, double v) {
  Eigen::VectorXd c = Eigen::VectorXd::Zero(DepthDistortion::terms(2));
  c(0) = u;  // P_2(x)
  c(2) = v;  // P_2(y)
  return DepthDistortion(kWidth, kHeight, c);
}

struct View {
  FloorResult floor;
  DisparityImage disparities;
};

// A wall in the left half, a floor below, each of chance slopes; `bend` is added to what is seen.
View view(std::mt19937_64& random, const std::function<double(int, int)>& bend) {
  std::uniform_real_distribution<double> slope(-0.05, 0.05), offset(8, 14);
  std::normal_distribution<double> noise(0, 0.05);
  View w;
  w.disparities = {kWidth, kHeight, std::vector<float>(kWidth * kHeight, 0)};
  w.floor.pixel_labels.assign(kWidth * kHeight, 0);
  w.floor.planes.resize(2);
  const double a[2] = {slope(random), slope(random)}, b[2] = {slope(random), slope(random)};
  const double c[2] = {offset(random), offset(random)};
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const int k = u < 80 && v < 70 ? 0 : v >= 60 ? 1 : -1;
      if (k < 0) continue;
      const auto i = static_cast<std::size_t>(v * kWidth + u);
      w.floor.pixel_labels[i] = static_cast<std::uint8_t>(k + 1);
      ++w.floor.planes[static_cast<std::size_t>(k)].pixels;
      w.disparities.d[i] =
          static_cast<float>(a[k] * u + b[k] * v + c[k] + 10 + bend(u, v) + noise(random));
    }
  }
  return w;
}

std::function<double(int, int)> as_function(const DepthDistortion& d) {
  return [&d](int u, int v) {
    return static_cast<double>(d.field()[static_cast<std::size_t>(v * kWidth + u)]);
  };
}

TEST(DistortionEstimator, FindsTheBend) {
  const DepthDistortion truth = bent(0.3, -0.2);
  std::mt19937_64 random(3);
  DistortionEstimator estimator;
  for (int i = 0; i < 30; ++i) {
    const View w = view(random, as_function(truth));
    estimator.add(w.floor, w.disparities);
  }
  EXPECT_EQ(estimator.frames(), 30);
  const auto found = estimator.estimate();
  ASSERT_TRUE(found);
  double worst = 0;
  for (std::size_t i = 0; i < truth.field().size(); ++i) {
    worst = std::max(worst, static_cast<double>(std::abs(found->field()[i] - truth.field()[i])));
  }
  EXPECT_LT(worst, 0.06);  // of 0.5; the corner without any plane is the worst
  EXPECT_NEAR(found->rms(), truth.rms(), 0.02);
  EXPECT_NEAR(found->largest(), truth.largest(), 0.06);
}

TEST(DistortionEstimator, TellsNothingWhereNothingIsBent) {
  std::mt19937_64 random(4);
  DistortionEstimator estimator;
  for (int i = 0; i < 30; ++i) {
    const View w = view(random, [](int, int) { return 0.0; });
    estimator.add(w.floor, w.disparities);
  }
  EXPECT_FALSE(estimator.estimate());
}

// Walls that are curved, each in its own way, are no fault of the camera.
TEST(DistortionEstimator, TellsNothingOfCurvedWalls) {
  std::mt19937_64 random(5);
  DistortionEstimator estimator;
  for (int i = 0; i < 30; ++i) {
    const double curve = std::uniform_real_distribution<double>(-0.4, 0.4)(random);
    const View w = view(random, [&](int u, int) { return curve * std::pow(u / 80.0 - 1, 2); });
    estimator.add(w.floor, w.disparities);
  }
  EXPECT_FALSE(estimator.estimate());
}

TEST(DistortionEstimator, TellsNothingOfTooFewFramesOrNone) {
  const DepthDistortion truth = bent(0.3, -0.2);
  std::mt19937_64 random(6);
  DistortionEstimator estimator;
  EXPECT_FALSE(estimator.estimate());
  for (int i = 0; i + 1 < DistortionEstimator::kLeast; ++i) {
    const View w = view(random, as_function(truth));
    estimator.add(w.floor, w.disparities);
  }
  EXPECT_FALSE(estimator.estimate());
  // Frames that hold nothing, or are of another size, are no frames.
  const int frames = estimator.frames();
  estimator.add({}, {kWidth / 2, kHeight / 2, std::vector<float>(kWidth * kHeight / 4, 10.0F)});
  estimator.add({}, {});
  EXPECT_EQ(estimator.frames(), frames);
}

TEST(DepthDistortion, IsTakenOutOfAFrame) {
  DepthCamera camera = testing::test_camera();
  camera.camera.width = kWidth;
  camera.camera.height = kHeight;
  DepthFrame frame;
  frame.camera = camera;
  const DepthDistortion bend = bent(0.4, 0.1);
  const double true_d = 12;
  for (const float e : bend.field()) {
    const double d = true_d + static_cast<double>(e);
    const double raw = camera.noise.focal_baseline / d * camera.depth_scale;
    frame.raw.push_back(static_cast<std::uint16_t>(raw + 0.5));
  }
  frame.raw[5] = 0;
  frame.raw[7] = 65535;
  bend.correct(frame);
  EXPECT_EQ(frame.raw[5], 0);
  EXPECT_EQ(frame.raw[7], 65535);
  for (std::size_t i = 8; i < frame.raw.size(); ++i) {
    const double d = camera.noise.disparity(frame.raw[i] / camera.depth_scale);
    ASSERT_NEAR(d, true_d, 0.002);  // a step of the raw value is 0.001
  }
}

TEST(DepthDistortion, LeavesOtherFramesAlone) {
  DepthFrame frame;
  frame.camera = testing::test_camera();
  frame.raw.assign(640 * 480, 3000);
  const auto before = frame.raw;
  bent(0.4, 0.1).correct(frame);
  EXPECT_EQ(frame.raw, before);
  DepthDistortion().correct(frame);
  EXPECT_EQ(frame.raw, before);
  EXPECT_TRUE(DepthDistortion().empty());
  EXPECT_EQ(DepthDistortion().rms(), 0);
}

// Where the error is as large as the disparity itself nothing is known.
TEST(DepthDistortion, MoreThanTheDisparityLeavesNoMeasurement) {
  DepthFrame frame;
  frame.camera = testing::test_camera();
  frame.camera.camera.width = kWidth;
  frame.camera.camera.height = kHeight;
  const double far_d = 0.7;
  const auto raw = static_cast<std::uint16_t>(frame.camera.noise.focal_baseline / far_d *
                                              frame.camera.depth_scale / 10);
  frame.camera.depth_scale /= 10;
  frame.raw.assign(kWidth * kHeight, raw);
  bent(5, 0).correct(frame);
  EXPECT_EQ(frame.raw[0], 0);                       // P_2(-1) = 1: 5 px of error
  EXPECT_LT(frame.raw[kWidth * 60 + 80], raw);      // P_2(0) = -1/2
  EXPECT_GT(frame.raw[kWidth * 60 + 80], raw / 6);  // 0.7 of 3.2 px
}

TEST(DepthDistortion, RefusesWrongCoefficients) {
  EXPECT_THROW(DepthDistortion(kWidth, kHeight, Eigen::VectorXd::Zero(4)), Error);
  EXPECT_THROW(DepthDistortion(0, kHeight, Eigen::VectorXd::Zero(3)), Error);
  EXPECT_EQ(DepthDistortion::terms(2), 3);
  EXPECT_EQ(DepthDistortion::basis(0.5, 0.5, 4).size(), 12);
  EXPECT_NEAR(DepthDistortion::basis(0.5, -1, 2)(0), 0.5 * (3 * 0.25 - 1), 1e-12);
  EXPECT_NEAR(DepthDistortion::basis(0.5, -1, 2)(1), -0.5, 1e-12);
}

}  // namespace
}  // namespace lamina
