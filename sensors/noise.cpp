// Noise models with their sources.
#include <lamina/sensors/noise.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {
constexpr double kKinectBaseline = 0.075;  // m, projector to camera [Khoshelham2012]
// [Khoshelham2012]: m / (f b) = 2.85e-5 per cm per unit of normalised disparity, sigma = 1/2 unit.
constexpr double kKinectStepPerZ2 = 2.85e-3;  // 1/m
constexpr double kKinectSigmaPerZ2 = 0.5 * kKinectStepPerZ2;
// A patch keeps a third of a pixel's sigma: neighbouring pixels come from one correlation window
// and one reference pattern, so averaging ends there (docs/sensors.md, "The floor of averaging").
constexpr double kKinectFloorShare = 1.0 / 3.0;
constexpr double kStereoFloorShare = 0.25;
constexpr double kSemiGlobalWindow = 5;  // px, the matching window of stereo_matcher.cpp
constexpr double kSixtyDegrees = M_PI / 3;
}  // namespace

DepthNoise DepthNoise::kinect(double focal_px) {
  DepthNoise noise;
  noise.kind = Kind::kKinect;
  noise.focal_baseline = focal_px * kKinectBaseline;
  noise.disparity_sigma = kKinectSigmaPerZ2 * noise.focal_baseline;
  noise.disparity_step = kKinectStepPerZ2 * noise.focal_baseline;
  noise.correlation_px = 3;
  noise.disparity_floor = kKinectFloorShare * noise.disparity_sigma;
  noise.min_range = 0.4;
  noise.max_range = 10;
  return noise;
}

DepthNoise DepthNoise::stereo(double focal_px, double baseline, double disparity_sigma) {
  DepthNoise noise;
  noise.kind = Kind::kStereo;
  noise.focal_baseline = focal_px * baseline;
  noise.disparity_sigma = disparity_sigma;
  noise.disparity_step = 1.0 / 16.0;  // fixed point of the matcher
  noise.correlation_px = kSemiGlobalWindow;
  noise.disparity_floor = kStereoFloorShare * disparity_sigma;
  noise.min_range = 0.1;
  // Beyond sigma_Z = 0.1 Z a depth says little about planes.
  noise.max_range = std::clamp(0.1 * noise.focal_baseline / disparity_sigma, 2.0, 200.0);
  return noise;
}

DepthNoise DepthNoise::bumblebee_xb3_wide() { return stereo(983, 0.24, 0.2); }
DepthNoise DepthNoise::bumblebee_xb3_narrow() { return stereo(983, 0.12, 0.2); }

DepthNoise DepthNoise::d4xx(double focal_px, double baseline) {
  // [Intel2018]: subpixel accuracy 0.08 px on a textured wall; steps of 1/32 px.
  DepthNoise noise = stereo(focal_px, baseline, 0.08);
  noise.disparity_step = 1.0 / 32.0;
  noise.correlation_px = 7;
  noise.min_range = 0.2;
  return noise;
}

DepthNoise DepthNoise::ideal(double focal_px) {
  // Not zero: estimators divide by it. A tenth of a millimetre at a metre.
  DepthNoise noise;
  noise.kind = Kind::kIdeal;
  noise.focal_baseline = focal_px * kKinectBaseline;
  noise.disparity_sigma = 1e-4 * noise.focal_baseline;
  noise.disparity_floor = 0.1 * noise.disparity_sigma;
  return noise;
}

double DepthNoise::sigma_lateral_px(double theta) const {
  if (kind == Kind::kIdeal) return 0;
  constexpr double kLargest = 85.0 / 180.0 * M_PI;  // the term has a pole at 90 degrees
  const double t = std::clamp(std::abs(theta), 0.0, kLargest);
  return 0.8 + 0.035 * t / (M_PI / 2 - t);
}

double DepthNoise::pixels_per_sample() const {
  return std::max(1.0, correlation_px * correlation_px);
}

double nguyen_sigma_depth(double z, double incidence) {
  const double base = 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4);
  const double t = std::abs(incidence);
  if (t <= kSixtyDegrees || z <= 0) return base;
  const double left = std::max(M_PI / 2 - t, 1e-2);
  return base + 0.0001 / std::sqrt(z) * t * t / (left * left);
}

}  // namespace lamina
