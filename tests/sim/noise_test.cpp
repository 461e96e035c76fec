// The sensors' noise against the models they claim.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/sim/depth_camera.hpp>
#include <lamina/sim/lidar.hpp>
#include <lamina/sim/odometry_sim.hpp>
#include <lamina/sim/world.hpp>

namespace lamina::sim {
namespace {

constexpr double kPi = 3.14159265358979323846;

TEST(Random, QuantileInvertsTheNormalDistribution) {
  for (double p : {1e-12, 1e-6, 0.01, 0.074, 0.3, 0.5, 0.8, 0.99, 1 - 1e-9}) {
    const double x = normal_quantile(p);
    EXPECT_NEAR(0.5 * std::erfc(-x / std::sqrt(2.0)) / p, 1, 1e-10) << p;
  }
  for (double x : {1e-300, 1e-3, 0.7, 1.0, 1.5, 123456.0}) {
    EXPECT_NEAR(portable_log(x), std::log(x), 1e-14 * std::max(1.0, std::abs(std::log(x))));
  }
}

TEST(Random, NumbersAreWhiteNormalAndKnown) {
  EXPECT_EQ(random_bits(1, 2, 3), random_bits(1, 2, 3));
  std::vector<float> noise(200001);
  NormalTable().fill(5, 6, noise);
  double sum = 0, square = 0, fourth = 0, next = 0;
  for (std::size_t i = 0; i + 1 < noise.size(); ++i) {
    const double x = static_cast<double>(noise[i]);
    sum += x, square += x * x, fourth += x * x * x * x;
    next += x * static_cast<double>(noise[i + 1]);
  }
  const double n = 200000;
  EXPECT_NEAR(sum / n, 0, 4 / std::sqrt(n));
  EXPECT_NEAR(square / n, 1, 4 * std::sqrt(2 / n));
  EXPECT_NEAR(fourth / n, 3, 4 * std::sqrt(96 / n));
  EXPECT_NEAR(next / n, 0, 4 / std::sqrt(n));
}

DepthCamera camera_of(const std::string& model) {
  DepthCamera camera = kinect_camera(SE3());
  if (model == "stereo") camera.noise = DepthNoise::stereo(525, 0.12, 0.2);
  if (model == "narrow") camera.noise = DepthNoise::stereo(525, 0.24, 0.4);
  if (model == "ideal") camera.noise = DepthNoise::ideal(525);
  camera.depth_scale = 10000;
  camera.noise.max_range = 7;  // 16 bits at this scale
  return camera;
}

/// Sum of squared residuals of disparity over the model's variance, by range bin of 0.5 m.
struct Bins {
  double sum[16] = {}, count[16] = {};
  void add(double z, double normalised) {
    const int bin = static_cast<int>(z / 0.5);
    if (bin >= 0 && bin < 16) {
      sum[bin] += normalised * normalised;
      count[bin] += 1;
    }
  }
};

class NoiseModel : public ::testing::TestWithParam<std::string> {};

// Walls that face the camera at many distances: every phase of the quantisation, no slope.
TEST_P(NoiseModel, DepthResidualsHaveTheModelsSigmaInEveryRangeBin) {
  const DepthCamera camera = camera_of(GetParam());
  DepthEffects effects;
  effects.distortion = false;  // a bias, not noise: tested on its own
  Bins bins;
  for (int i = 0; i < 60; ++i) {
    const double z = 0.8 + 0.1 * i + 0.0137 * (i % 7);
    Scene scene;
    scene.add_rectangle("wall", PlaneLabel::kWall, {-9, -9, z}, {0, 18, 0}, {18, 0, 0});
    const Caster caster(scene);
    const DepthRenderer renderer(caster, camera, effects, 17);
    const DepthFrame frame = renderer.render(SE3(), {}, static_cast<std::uint64_t>(i));
    for (int v = 0; v < frame.height(); v += 3) {
      for (int u = 0; u < frame.width(); u += 3) {
        if (frame.raw_at(u, v) > 0 && z < 6.5) {
          bins.add(z, (frame.depth_m(u, v) - z) / camera.noise.sigma_depth(z));
        }
      }
    }
  }
  for (int k = 2; k < 12; ++k) {
    ASSERT_GT(bins.count[k], 50000) << k;
    EXPECT_GT(bins.sum[k] / bins.count[k], 0.9) << "from " << 0.5 * k << " m";
    EXPECT_LT(bins.sum[k] / bins.count[k], 1.1) << "from " << 0.5 * k << " m";
  }
}

// A floor: what the lateral shift adds to a slope of s px of disparity a pixel is s^2 sigma^2.
TEST_P(NoiseModel, FloorResidualsAddTheLateralShift) {
  const DepthCamera camera = camera_of(GetParam());
  DepthEffects effects;
  effects.distortion = effects.grazing = effects.shadow = false;
  Scene scene;
  scene.add_ground("floor", PlaneLabel::kFloor, {-30, -30, 30, 30}, 0);
  const Caster caster(scene);
  const SE3 T_map_camera = mount_camera({0, 0, 0.8}, 0, 0.44, 0);
  const DepthRenderer renderer(caster, camera, effects, 3);
  const DepthTruth truth = renderer.truth(T_map_camera);
  const Plane floor_camera = T_map_camera.inverse() * Plane();
  const double fb = camera.noise.focal_baseline;
  const double slope_u = fb * floor_camera.normal().x() / floor_camera.rho() / camera.camera.fx;
  const double slope_v = fb * floor_camera.normal().y() / floor_camera.rho() / camera.camera.fy;
  const double sigma2 = camera.noise.disparity_sigma * camera.noise.disparity_sigma +
                        (slope_u * slope_u + slope_v * slope_v) * 0.25;
  Bins bins;
  for (std::uint64_t i = 0; i < 6; ++i) {
    const DepthFrame frame = renderer.measure(truth, T_map_camera, {}, i);
    for (int v = 0; v < frame.height(); v += 2) {
      for (int u = 0; u < frame.width(); u += 2) {
        const double w = static_cast<double>(truth.inverse_depth[truth.index(u, v)]);
        if (frame.raw_at(u, v) > 0 && w > 1.0 / 5) {
          bins.add(1 / w, (frame.disparity(u, v) - fb * w) / std::sqrt(sigma2));
        }
      }
    }
  }
  for (int k = 2; k < 10; ++k) {
    ASSERT_GT(bins.count[k], 3000) << k;
    EXPECT_GT(bins.sum[k] / bins.count[k], 0.9) << "from " << 0.5 * k << " m";
    EXPECT_LT(bins.sum[k] / bins.count[k], 1.1) << "from " << 0.5 * k << " m";
  }
}

INSTANTIATE_TEST_SUITE_P(Models, NoiseModel, ::testing::Values("kinect", "stereo", "narrow"),
                         [](const auto& model) { return model.param; });

// The integral of the correlation over the lag, along rows and columns, is correlation_px.
TEST(DepthRenderer, NoiseIsCorrelatedOverTheStatedLength) {
  for (double stated : {1.0, 2.0, 3.0, 5.0}) {
    DepthCamera camera = camera_of("kinect");
    camera.noise.correlation_px = stated;
    DepthEffects effects = DepthEffects::none();
    effects.noise = effects.correlated = true;
    Scene scene;
    scene.add_rectangle("wall", PlaneLabel::kWall, {-9, -9, 3}, {0, 18, 0}, {18, 0, 0});
    const Caster caster(scene);
    const DepthRenderer renderer(caster, camera, effects, 17);
    const DepthTruth truth = renderer.truth(SE3());
    double rows[12] = {}, columns[12] = {};
    for (std::uint64_t i = 0; i < 4; ++i) {
      const DepthFrame frame = renderer.measure(truth, SE3(), {}, i);
      for (int v = 0; v + 12 < frame.height(); ++v) {
        for (int u = 0; u + 12 < frame.width(); ++u) {
          const double middle = frame.depth_m(u, v) - 3;
          for (int lag = 0; lag < 12; ++lag) {
            rows[lag] += middle * (frame.depth_m(u + lag, v) - 3);
            columns[lag] += middle * (frame.depth_m(u, v + lag) - 3);
          }
        }
      }
    }
    double along_rows = 1, along_columns = 1;
    for (int lag = 1; lag < 12; ++lag) {
      along_rows += 2 * rows[lag] / rows[0];
      along_columns += 2 * columns[lag] / columns[0];
    }
    EXPECT_NEAR(along_rows, stated, 0.05 * stated + 0.05);
    EXPECT_NEAR(along_columns, stated, 0.05 * stated + 0.05);
  }
}

TEST(DepthRenderer, ShadowFallsLeftOfNearEdges) {
  Scene scene;
  scene.add_rectangle("far", PlaneLabel::kWall, {-9, -9, 4}, {0, 18, 0}, {18, 0, 0});
  scene.add_rectangle("near", PlaneLabel::kWall, {-0.2, -9, 1.5}, {0, 18, 0}, {0.4, 0, 0});
  const Caster caster(scene);
  const DepthCamera camera = camera_of("kinect");
  DepthEffects effects = DepthEffects::none();
  effects.shadow = true;
  const DepthFrame frame = DepthRenderer(caster, camera, effects, 1).render(SE3(), {}, 0);
  const int left = static_cast<int>(std::ceil(525 * -0.2 / 1.5 + 319.5));  // first near pixel
  const double band = camera.noise.focal_baseline * (1 / 1.5 - 1 / 4.0);
  EXPECT_NEAR(band, 16.4, 0.05);
  for (int u = 100; u < 540; ++u) {
    const bool expected_lost = u < left && u > left - band;
    EXPECT_EQ(frame.raw_at(u, 200) == 0, expected_lost) << u;
  }
}

TEST(DepthRenderer, GrazingSurfacesDropOutAroundEightyDegrees) {
  Scene scene;
  scene.add_ground("floor", PlaneLabel::kFloor, {-60, -60, 60, 60}, 0);
  const Caster caster(scene);
  DepthCamera camera = camera_of("kinect");
  camera.noise.max_range = 100;
  camera.depth_scale = 1000;
  DepthEffects effects = DepthEffects::none();
  effects.grazing = true;
  const SE3 T_map_camera = mount_camera({0, 0, 0.5}, 0, 0.2, 0);
  const DepthRenderer renderer(caster, camera, effects, 1);
  const DepthTruth truth = renderer.truth(T_map_camera);
  const DepthFrame frame = renderer.measure(truth, T_map_camera, {}, 0);
  int middle = 0, lost = 0;
  for (int v = 0; v < 480; ++v) {
    const Eigen::Vector3d ray((320 - 319.5) / 525, (v - 239.5) / 525, 1);
    const double cosine = -(T_map_camera.so3() * ray.normalized()).z();
    const double incidence = std::acos(cosine) * 180 / kPi;
    if (cosine <= 0 || incidence > 85) continue;
    if (incidence < 77.9) {
      EXPECT_GT(frame.raw_at(320, v), 0) << incidence;
    }
    if (incidence > 82.1) {
      EXPECT_EQ(frame.raw_at(320, v), 0) << incidence;
    }
    if (incidence > 79.5 && incidence < 80.5) {
      for (int u = 300; u < 340; ++u) {
        ++middle;
        lost += frame.raw_at(u, v) == 0 ? 1 : 0;
      }
    }
  }
  ASSERT_GT(middle, 200);
  EXPECT_NEAR(static_cast<double>(lost) / middle, 0.5, 0.12);
}

TEST(DepthRenderer, DistortionIsSlowFixedAndOfItsSize) {
  Scene scene;
  scene.add_rectangle("wall", PlaneLabel::kWall, {-9, -9, 3}, {0, 18, 0}, {18, 0, 0});
  const Caster caster(scene);
  DepthEffects effects = DepthEffects::none();
  effects.distortion = true;
  effects.distortion_sigma_px = 0.05;
  double square = 0, step = 0, count = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const DepthRenderer renderer(caster, camera_of("kinect"), effects, seed);
    const std::vector<float>& field = renderer.distortion();
    for (std::size_t i = 0; i + 1 < field.size(); i += 7) {
      square += static_cast<double>(field[i] * field[i]);
      step = std::max(
          step, i % 640 == 639 ? 0.0 : static_cast<double>(std::abs(field[i + 1] - field[i])));
      count += 1;
    }
  }
  EXPECT_NEAR(std::sqrt(square / count), 0.05, 0.01);
  EXPECT_LT(step, 0.004);
}

TEST(LidarSimulator, RangeNoiseDropOutsAndMixedPixels) {
  Scene scene;
  scene.add_wall("wall", {4, -20}, {4, 20}, -1, 1);
  scene.add_box("post", SE3::planar(2, 0, 0) * SE3::from_translation({0, 0, -1}), {0.2, 0.2, 2});
  const Caster caster(scene);
  LidarModel model;
  model.noise.range_sigma = 0.02;
  LidarGeometry geometry;
  geometry.angle_min = -0.5, geometry.angle_increment = 0.002, geometry.beams = 501;
  LidarEffects effects;
  effects.dropout = 0.05;
  const LidarSimulator lidar(caster, model, geometry, effects, 4);
  const ScanTruth truth = lidar.truth(SE3());
  double square = 0, count = 0, lost = 0, between = 0, scans = 200;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const LaserScan scan = lidar.measure(truth, SE3(), {}, i);
    for (std::size_t k = 0; k < scan.size(); ++k) {
      const double error = static_cast<double>(scan.ranges[k]) - truth.ranges[k];
      if (scan.ranges[k] == 0) {
        lost += 1;
      } else if (std::abs(error) > 0.15) {
        between += 1;
      } else {
        square += error * error / (0.02 * 0.02);
        count += 1;
      }
    }
  }
  EXPECT_NEAR(square / count, 1, 0.03);
  EXPECT_NEAR(lost / (scans * 501), 0.05, 0.005);
  EXPECT_GT(between, 20);  // two edges, 200 scans, 30 % of the two beams at each
  EXPECT_LT(between, 200);
}

TEST(OdometrySimulator, DriftsByItsRandomWalkWhateverTheRate) {
  for (int steps : {20, 200}) {
    double along = 0, heading = 0;
    const int runs = 400;
    for (std::uint64_t seed = 0; seed < runs; ++seed) {
      OdometryErrors errors;
      OdometrySimulator odometry(errors, seed);
      SE3 last;
      for (int i = 0; i <= steps; ++i) {
        const double t = 4.0 * i / steps;
        last = odometry.step(Timestamp::from_seconds(t), t, SE3::planar(t, 0, 0)).T_odom_body;
      }
      along += (last.translation().x() - 4) * (last.translation().x() - 4);
      heading += last.so3().yaw() * last.so3().yaw();
    }
    EXPECT_NEAR(std::sqrt(along / runs), 0.02 * 2, 0.005) << steps;
    EXPECT_NEAR(std::sqrt(heading / runs), 0.02 * 2, 0.005) << steps;
  }
}

}  // namespace
}  // namespace lamina::sim
