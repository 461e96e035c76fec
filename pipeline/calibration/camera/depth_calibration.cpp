// Some images of a recording, looked at for what all of them share.
#include <lamina/pipeline/calibration/camera/depth_calibration.hpp>

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/models/median.hpp>
#include <lamina/pipeline/calibration/camera/distortion_estimator.hpp>
#include <lamina/pipeline/calibration/log.hpp>
#include <lamina/sensors/depth_images.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;

// What the floors of one camera have in common.
class SeenFloors {
 public:
  void add(const FloorResult& floor, const FloorFrontend& frontend,
           const SE3& T_body_camera_calibrated) {
    if (!floor.floor_camera) return;
    if (!frontend.calibration_wrong()) as_calibrated_ = true;
    const Leveling l = leveling_of(T_body_camera_calibrated, *floor.floor_camera);
    roll_.push_back(l.roll);
    pitch_.push_back(l.pitch);
    height_.push_back(l.height);
  }
  // Where calibration is contradicted by all, and most of ten and more agree.
  std::optional<Leveling> mounting() const {
    constexpr double kAgree = 0.5 * kDegree, kAgreeHeight = 0.02;  // rad, m
    if (as_calibrated_ || roll_.size() < kLeast) return std::nullopt;
    const Leveling middle{median(roll_), median(pitch_), median(height_)};
    std::size_t agree = 0;
    for (std::size_t i = 0; i < roll_.size(); ++i) {
      agree += std::hypot(roll_[i] - middle.roll, pitch_[i] - middle.pitch) < kAgree &&
               std::abs(height_[i] - middle.height) < kAgreeHeight;
    }
    if (2 * agree < roll_.size()) return std::nullopt;
    return middle;
  }
  std::optional<Leveling> ground() const {
    if (roll_.size() < kLeast) return std::nullopt;
    return Leveling{sigma_of(roll_), sigma_of(pitch_), sigma_of(height_)};
  }

 private:
  static constexpr std::size_t kLeast = 10;

  // Of independent values: half of the mean square of differences, by the median.
  static double sigma_of(const std::vector<double>& values) {
    constexpr double kMedianOfDifferences = 0.6745 * M_SQRT2;
    std::vector<double> changes;
    for (std::size_t i = 1; i < values.size(); ++i)
      changes.push_back(std::abs(values[i] - values[i - 1]));
    return median(changes) / kMedianOfDifferences;
  }

  bool as_calibrated_ = false;  // a floor was once where it should be
  std::vector<double> roll_, pitch_, height_;
};

}  // namespace

DepthCalibration calibrate_depth(Recording& recording, const FloorOptions& options,
                                 Diagnostics& metrics, const std::function<bool()>& ended) {
  constexpr std::int64_t kImages = 120, kUnknown = 1200;
  const std::int64_t all = recording.depth_hint().value_or(kUnknown);
  const std::int64_t every = std::max<std::int64_t>(1, (all + kImages - 1) / kImages);
  FloorFrontend frontend(options);
  DistortionEstimator estimator;
  SeenFloors floors;
  for (std::int64_t k = 0; k < kImages && !ended(); ++k) {
    const auto frame = next_depth_image(recording, k == 0 ? 0 : every - 1);
    if (!frame) break;
    const FloorResult floor = frontend.process(*frame);
    estimator.add(floor, frontend.disparities(), frame->camera.camera);
    floors.add(floor, frontend, frame->camera.camera.T_body_camera);
  }
  DepthCalibration result;
  if (ended()) return result;
  result.mounting = floors.mounting();
  result.ground = floors.ground();
  if (result.mounting) {
    const Leveling& l = *result.mounting;
    run_log().info(
        "camera is not mounted as calibrated: floors have it turned by ({:+.2f}, {:+.2f}) deg, "
        "{:.3f} m high",
        l.roll / kDegree, l.pitch / kDegree, l.height);
    metrics.counts.camera_start_roll_deg = l.roll / kDegree;
    metrics.counts.camera_start_pitch_deg = l.pitch / kDegree;
    metrics.counts.camera_start_height_m = l.height;
  }
  const auto distortion = estimator.estimate();
  if (!distortion) return result;
  run_log().info("depth images bend by {:.3f} px of disparity rms, {:.2f} at most: taken out",
                 distortion->rms(), distortion->largest());
  metrics.counts.depth_bend_rms_px = distortion->rms();
  metrics.counts.depth_bend_max_px = distortion->largest();
  result.bend = *distortion;
  return result;
}

}  // namespace lamina
