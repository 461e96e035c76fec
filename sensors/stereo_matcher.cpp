// Depth from rectified stereo pairs: semi-global matching [Hirschmuller2008] by OpenCV.
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/error.hpp>
#include <lamina/sensors/stereo_frame.hpp>

namespace lamina {
namespace {
constexpr int kWindow = 5;                // px, side of the matching window
constexpr int kSteps = 16;                // OpenCV gives disparity in 1/16 px and ranges in 16 px
constexpr double kSearchShare = 1 / 6.0;  // of the width: near limit f b / (width / 6)
constexpr double kRelativeSigma = 0.05;   // depth is kept up to sigma_Z = 5 % of Z
constexpr double kNearestLimit = 5, kFurthestLimit = 30;  // m, bounds of that limit
constexpr int kRawAtLimit = 65000;  // raw units at the limit: 16 bits are used well
constexpr int kSpeckleArea = 100, kSpeckleStep = 2;  // px

int round_up(int value, int step) { return (value + step - 1) / step * step; }

// Disparity of the left image in 1/16 px; below 0 where nothing matches. Both images are widened
// on the left by the search range, because SGBM gives nothing for columns below it.
cv::Mat match(const cv::Mat& left, const cv::Mat& right, int search) {
  cv::Mat wide_left, wide_right, disparity;
  cv::copyMakeBorder(left, wide_left, 0, 0, search, 0, cv::BORDER_REPLICATE);
  cv::copyMakeBorder(right, wide_right, 0, 0, search, 0, cv::BORDER_REPLICATE);
  constexpr int kArea = kWindow * kWindow;
  const int left_right_tolerance = 1;  // px
  const int uniqueness = 8;            // percent the best must lead by
  const auto matcher = cv::StereoSGBM::create(0, search, kWindow, 8 * kArea, 32 * kArea,
                                              left_right_tolerance, 63, uniqueness, kSpeckleArea,
                                              kSpeckleStep, cv::StereoSGBM::MODE_SGBM_3WAY);
  matcher->compute(wide_left, wide_right, disparity);
  return disparity.colRange(search, disparity.cols);
}
}  // namespace

DepthFrame depth_from_stereo(const StereoFrame& pair) {
  const CameraModel& camera = pair.camera.camera;
  const auto size =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  LAMINA_CHECK(camera.width > 0 && pair.left.size() == size && pair.right.size() == size);
  LAMINA_CHECK(!camera.distortion && pair.camera.baseline > 0 && pair.camera.disparity_sigma > 0);
  DepthFrame frame;
  frame.stamp = pair.stamp;
  frame.camera.camera = camera;
  DepthNoise& noise = frame.camera.noise;
  noise = DepthNoise::stereo(camera.fx, pair.camera.baseline, pair.camera.disparity_sigma);
  const double fb = noise.focal_baseline;
  noise.max_range =
      std::clamp(kRelativeSigma * fb / pair.camera.disparity_sigma, kNearestLimit, kFurthestLimit);
  frame.camera.depth_scale = std::floor(kRawAtLimit / noise.max_range);
  frame.raw.assign(size, 0);
  const int search =
      std::max(kSteps, round_up(static_cast<int>(std::ceil(camera.width * kSearchShare)), kSteps));
  noise.min_range = fb / search;
  if (camera.width <= 2 * kWindow || camera.height <= 2 * kWindow) return frame;

  const auto header = [&](const std::vector<std::uint8_t>& image) {
    return cv::Mat(camera.height, camera.width, CV_8U, const_cast<std::uint8_t*>(image.data()));
  };
  const cv::Mat disparity = match(header(pair.left), header(pair.right), search);
  for (int v = 0; v < camera.height; ++v) {
    const auto* row = disparity.ptr<std::int16_t>(v);
    for (int u = 0; u < camera.width; ++u) {
      const double d = row[u] / static_cast<double>(kSteps);
      // A match left of the right image's edge would be one with the border added above.
      if (d <= 0 || d > u) continue;
      const double z = fb / d;
      if (z > noise.max_range) continue;
      frame.raw[static_cast<std::size_t>(v * camera.width + u)] =
          static_cast<std::uint16_t>(std::lround(z * frame.camera.depth_scale));
    }
  }
  return frame;
}

}  // namespace lamina
