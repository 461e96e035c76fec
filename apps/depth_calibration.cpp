// Some images of a recording, looked at for what all of them share.
#include <lamina/apps/depth_calibration.hpp>

#include <spdlog/spdlog.h>

#include <algorithm>

#include <lamina/apps/depth_images.hpp>
#include <lamina/frontend/floor/distortion_estimator.hpp>
#include <lamina/frontend/floor/floor_frontend.hpp>

namespace lamina::apps {

DepthDistortion calibrate_depth(Recording& recording, const FloorOptions& options,
                                io::Metrics& metrics, const std::function<bool()>& ended) {
  constexpr std::int64_t kImages = 120, kUnknown = 1200;
  const std::int64_t all = recording.depth_hint().value_or(kUnknown);
  const std::int64_t every = std::max<std::int64_t>(1, (all + kImages - 1) / kImages);
  FloorFrontend frontend(options);
  DistortionEstimator estimator;
  for (std::int64_t k = 0; k < kImages && !ended(); ++k) {
    const auto frame = next_depth_image(recording, k == 0 ? 0 : every - 1);
    if (!frame) break;
    const FloorResult floor = frontend.process(*frame);
    estimator.add(floor, frontend.disparities(), frame->camera.camera);
  }
  const auto distortion = ended() ? std::nullopt : estimator.estimate();
  if (!distortion) return {};
  spdlog::info("depth images bend by {:.3f} px of disparity rms, {:.2f} at most: taken out",
               distortion->rms(), distortion->largest());
  metrics.counts["depth_bend_rms_px"] = distortion->rms();
  metrics.counts["depth_bend_max_px"] = distortion->largest();
  return *distortion;
}

}  // namespace lamina::apps
