// The bend of a depth image: what planes tell of it, and its removal.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include <lamina/models/error.hpp>
#include <lamina/pipeline/calibration/camera/distortion_estimator.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

constexpr int kWidth = 160, kHeight = 120;
const CameraModel kCamera = testing::small_test_camera(0.3).camera;

DepthDistortion bent(double u, double v) {
  Eigen::VectorXd c = Eigen::VectorXd::Zero(DepthDistortion::terms(2));
  c(3) = u;  // P_2(x)
  c(5) = v;  // P_2(y)
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

TEST(DepthDistortion, GivesFramesTheFocalLengthThatIs) {
  DepthFrame frame =
      testing::draw({{Plane({0, 0, 1}, 0)}}, testing::small_test_camera(0.3), 0.02, 1);
  const DepthFrame as_stated = frame;
  DepthDistortion distortion;
  distortion.add({Eigen::Vector3d::Zero(), 0.02}, as_stated);
  EXPECT_FALSE(distortion.empty());
  distortion.correct(frame);
  EXPECT_NEAR(frame.camera.camera.fx, as_stated.camera.camera.fx / 1.02, 1e-9);
  EXPECT_NEAR(frame.camera.camera.fy, as_stated.camera.camera.fy / 1.02, 1e-9);
  EXPECT_EQ(frame.raw, as_stated.raw);
}

TEST(DistortionEstimator, FindsTheBend) {
  const DepthDistortion truth = bent(0.3, -0.2);
  std::mt19937_64 random(3);
  DistortionEstimator estimator;
  for (int i = 0; i < 30; ++i) {
    const View w = view(random, as_function(truth));
    estimator.add(w.floor, w.disparities, kCamera);
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

// Waves across the image: the nearest polynomial of degree 10 leaves 18 % of them where planes are.
TEST(DistortionEstimator, FindsWaves) {
  const auto waves = [](int u, int v) {
    return 0.2 * std::cos(2 * M_PI * (2.4 * u / kWidth - 1.8 * v / kHeight));
  };
  std::mt19937_64 random(6);
  DistortionEstimator estimator;
  for (int i = 0; i < 36; ++i) {
    const View w = view(random, waves);
    estimator.add(w.floor, w.disparities, kCamera);
  }
  const auto found = estimator.estimate();
  ASSERT_TRUE(found);
  // Over the floor, less what a plane takes of it.
  Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double before = 0, after = 0;
  int count = 0;
  for (int v = 72; v < kHeight; v += 2) {
    for (int u = 0; u < kWidth; u += 2) {
      const auto i = static_cast<std::size_t>(v * kWidth + u);
      const double off = static_cast<double>(found->field()[i]) - waves(u, v);
      const Eigen::Vector3d x(u, v, 1);
      N += x * x.transpose();
      b += off * x;
      after += off * off;
      before += std::pow(waves(u, v), 2);
      ++count;
    }
  }
  after -= b.dot(N.ldlt().solve(b));
  EXPECT_LT(std::sqrt(after / count), 0.15 * std::sqrt(before / count))
      << std::sqrt(after / count) << " px left of " << std::sqrt(before / count);
}

TEST(DistortionEstimator, TellsNothingWhereNothingIsBent) {
  std::mt19937_64 random(4);
  DistortionEstimator estimator;
  for (int i = 0; i < 30; ++i) {
    const View w = view(random, [](int, int) { return 0.0; });
    estimator.add(w.floor, w.disparities, kCamera);
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
    estimator.add(w.floor, w.disparities, kCamera);
  }
  EXPECT_FALSE(estimator.estimate());
}

// A floor in the lower half of the image and walls to its sides, turned by `heading` (rad); the
// second wall is off the right angle by `askew`. `bend` (px) is added to what is seen.
View room(std::mt19937_64& random, double heading, double askew,
          const std::function<double(int, int)>& bend) {
  const double fb = testing::small_test_camera(0).noise.focal_baseline;
  const double pitch = 0.3;
  const SO3 R = SO3::rot_x(pitch) * SO3::rot_y(heading), turned = R * SO3::rot_y(askew);
  const Eigen::Vector3d q[3] = {R * Eigen::Vector3d(-fb, 0, 0), turned * Eigen::Vector3d(fb, 0, 0),
                                R * Eigen::Vector3d(0, fb / 0.8, 0)};
  std::normal_distribution<double> noise(0, 0.05);
  View w;
  w.disparities = {kWidth, kHeight, std::vector<float>(kWidth * kHeight, 0)};
  w.floor.pixel_labels.assign(kWidth * kHeight, 0);
  w.floor.planes.resize(3);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const std::size_t k = v >= 80 ? 2 : u >= 80 ? 1 : 0;
      const Eigen::Vector3d ray((u - kCamera.cx) / kCamera.fx, (v - kCamera.cy) / kCamera.fy, 1);
      const double d = q[k].dot(ray);
      if (d < 3) continue;
      const auto i = static_cast<std::size_t>(v * kWidth + u);
      w.floor.pixel_labels[i] = static_cast<std::uint8_t>(k + 1);
      ++w.floor.planes[k].pixels;
      w.disparities.d[i] = static_cast<float>(d + bend(u, v) + noise(random));
    }
  }
  return w;
}

DistortionEstimator tour(double askew, const std::function<double(int, int)>& bend) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> heading(-0.25, 0.25), off(-askew, askew);
  DistortionEstimator estimator;
  for (int i = 0; i < 48; ++i) {
    const View w = room(random, heading(random), off(random), bend);
    estimator.add(w.floor, w.disparities, kCamera);
  }
  return estimator;
}

// Neither bows a plane: it is by the angles between them that they show.
TEST(DistortionEstimator, RightAnglesTellConstantAndSlopes) {
  const auto bend = [](int u, int v) { return 0.6 + 0.3 * (u / 80.0 - 1) - 0.2 * (v / 60.0 - 1); };
  const auto found = tour(0, bend).estimate();
  ASSERT_TRUE(found);
  const auto at = as_function(*found);
  for (const auto& [u, v] : {std::pair(20, 40), {140, 40}, {80, 60}, {40, 110}, {120, 110}})
    EXPECT_NEAR(at(u, v), bend(u, v), 0.12) << u << ", " << v;
}

TEST(DistortionEstimator, RightAnglesOfAStraightImageTellNothing) {
  EXPECT_FALSE(tour(0, [](int, int) { return 0.0; }).estimate());
}

// Walls that stand at any angle to each other are no fault of the camera.
TEST(DistortionEstimator, AskewWallsTellNothing) {
  EXPECT_FALSE(tour(0.2, [](int, int) { return 0.0; }).estimate());
}

TEST(DistortionEstimator, TellsNothingOfTooFewFramesOrNone) {
  const DepthDistortion truth = bent(0.3, -0.2);
  std::mt19937_64 random(6);
  DistortionEstimator estimator;
  EXPECT_FALSE(estimator.estimate());
  for (int i = 0; i + 1 < DistortionEstimator::kLeast; ++i) {
    const View w = view(random, as_function(truth));
    estimator.add(w.floor, w.disparities, kCamera);
  }
  EXPECT_FALSE(estimator.estimate());
  // Frames that hold nothing, or are of another size, are no frames.
  const int frames = estimator.frames();
  estimator.add({}, {kWidth / 2, kHeight / 2, std::vector<float>(kWidth * kHeight / 4, 10.0F)},
                kCamera);
  estimator.add({}, {}, kCamera);
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

TEST(DepthDistortion, IsHeldWithinBounds) {
  DepthDistortion bend = bent(0.4, 0.1);
  ASSERT_GT(bend.largest(), 0.4);
  bend.hold_within(-0.05, 0.2);
  EXPECT_NEAR(bend.largest(), 0.2, 1e-6);
  EXPECT_NEAR(*std::min_element(bend.field().begin(), bend.field().end()), -0.05F, 1e-6);
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
  EXPECT_EQ(DepthDistortion::terms(2), 6);
  const Eigen::VectorXd basis = DepthDistortion::basis(0.5, -1, 4);
  ASSERT_EQ(basis.size(), 15);
  EXPECT_EQ(basis.head<3>(), Eigen::Vector3d(1, 0.5, -1));
  EXPECT_NEAR(basis(3), 0.5 * (3 * 0.25 - 1), 1e-12);
  EXPECT_NEAR(basis(4), -0.5, 1e-12);
}

}  // namespace
}  // namespace lamina
