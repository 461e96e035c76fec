// Rendered pairs through real stereo matching.
#include <lamina/sim/stereo.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>

#include <lamina/sim/sim_recording.hpp>

namespace lamina::sim {
namespace {

TEST(StereoRenderer, SemiGlobalMatchingFindsTheTrueDepthOfARoom) {
  World world = make_scene("room", {{"stereo.enabled", "on"},
                                    {"camera.enabled", "off"},
                                    {"lidar.enabled", "off"},
                                    {"stereo.rate_hz", "0.2"}});
  const StereoCamera camera = world.rig.stereo->camera;
  Simulation simulation(std::move(world), 1);
  const cv::Ptr<cv::StereoSGBM> matcher =
      cv::StereoSGBM::create(0, 96, 5, 8 * 25, 32 * 25, 1, 0, 10, 100, 2);
  double matched = 0, good = 0, all = 0;
  int pairs = 0;
  while (auto measurement = simulation.next()) {
    auto* pair = std::get_if<StereoFrame>(&*measurement);
    if (pair == nullptr) continue;
    const CameraModel& c = camera.camera;
    const cv::Mat left(c.height, c.width, CV_8U, pair->left.data());
    const cv::Mat right(c.height, c.width, CV_8U, pair->right.data());
    cv::Mat disparity;
    matcher->compute(left, right, disparity);
    const DepthTruth& truth = simulation.depth_truth();
    for (int v = 0; v < c.height; ++v) {
      for (int u = 96; u < c.width; ++u) {
        const double w = static_cast<double>(truth.inverse_depth[truth.index(u, v)]);
        all += w > 0 ? 1 : 0;
        const double found = disparity.at<std::int16_t>(v, u) / 16.0;
        if (found > 0 && w > 0) {
          // Three sigma of depth, Z^2 / (f b) sigma_d, at the true depth.
          const double z = 1 / w, fb = c.fx * camera.baseline;
          const double sigma = z * z / fb * camera.disparity_sigma;
          matched += 1;
          good += std::abs(fb / found - z) <= 3 * sigma ? 1 : 0;
        }
      }
    }
    if (++pairs == 3) break;
  }
  ASSERT_EQ(pairs, 3);
  RecordProperty("matched", std::to_string(matched / all));
  RecordProperty("within_three_sigma", std::to_string(good / matched));
  EXPECT_GT(matched / all, 0.6);
  EXPECT_GT(good / matched, 0.9);
}

TEST(Texture, IsTheSameForEveryCameraAndSmoothAtItsFootprint) {
  const Eigen::Vector3d p(1.234, -0.5, 0.8);
  EXPECT_EQ(texture_at(p, 0.002, 1), texture_at(p, 0.002, 1));
  EXPECT_NE(texture_at(p, 0.002, 1), texture_at(p, 0.002, 2));
  double rough = 0, mean = 0, square = 0;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d x(0.011 * i, 0.3, 0.2);
    const double grey = texture_at(x, 0.01, 1);
    rough = std::max(rough, std::abs(texture_at(x + Eigen::Vector3d(0.001, 0, 0), 0.01, 1) - grey));
    mean += grey / 2000, square += grey * grey / 2000;
  }
  EXPECT_LT(rough, 0.15);  // a tenth of a pixel
  EXPECT_NEAR(mean, 0.5, 0.1);
  EXPECT_GT(std::sqrt(square - mean * mean), 0.12);  // contrast enough to match
}

}  // namespace
}  // namespace lamina::sim
