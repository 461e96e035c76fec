// Every image while the robot drives its first metres, few before and after.
#include <lamina/pipeline/calibration/initial_attitude.hpp>

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/pipeline/calibration/log.hpp>
#include <lamina/sensors/depth_images.hpp>

namespace lamina {
namespace {

// The wheels' way from image to image. Turns in place are no way: what stands tilted turns so.
class Way {
 public:
  explicit Way(const WheelTrack& wheels) : wheels_(wheels) {}
  double to(Timestamp stamp) {
    const auto T = wheels_.at(stamp);
    if (!T) return way_;
    if (begun_) way_ += (T->translation() - last_).norm();
    last_ = T->translation();
    begun_ = true;
    return way_;
  }

 private:
  const WheelTrack& wheels_;
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();
  bool begun_ = false;
  double way_ = 0;
};

}  // namespace

std::optional<TiltedStart> find_tilted_start(Recording& recording, const WheelTrack& wheels,
                                             const FloorOptions& options,
                                             const DepthDistortion& distortion,
                                             const std::function<bool()>& ended) {
  constexpr std::int64_t kImages = 100, kUnknown = 600, kMostSkipped = 16;
  constexpr double kStill = 0.01;  // m between two images
  const Calibration& sensors = recording.calibration();
  if (!sensors.odometry.planar || !sensors.depth_camera || !wheels.moved() ||
      !options.self_calibrate) {
    return std::nullopt;
  }
  const std::int64_t all = recording.depth_hint().value_or(kUnknown);
  const std::int64_t every = std::max<std::int64_t>(1, (all + kImages - 1) / kImages);
  FloorOptions by_each = options;
  by_each.self_calibrate = false;  // each floor against the calibration
  FloorFrontend frontend(by_each);
  const SE3 T_body_camera = sensors.depth_camera->camera.T_body_camera;
  StartWatch watch(T_body_camera);
  Way way(wheels);
  double last = 0;
  for (std::int64_t skip = 0; watch.wants_more() && !ended();) {
    auto frame = next_depth_image(recording, skip);
    if (!frame) break;
    distortion.correct(*frame);
    const FloorResult floor = frontend.process(*frame);
    const double now = way.to(frame->stamp);
    if (floor.floor_camera) watch.add(leveling_of(T_body_camera, *floor.floor_camera), now);
    const bool stands = now - last < kStill;
    skip = watch.past_start() ? every - 1 : stands ? std::min(2 * skip + 1, kMostSkipped) : 0;
    last = now;
  }
  return ended() ? std::nullopt : watch.result();
}

void tell_start(const TiltedStart& start, Diagnostics& metrics) {
  const SE3 T_level_body = start.T_level_body();
  const double tilt = std::acos(std::min(1.0, (T_level_body.so3() * Eigen::Vector3d::UnitZ()).z()));
  run_log().info("the body stands tilted by {:.1f} deg where the recording begins",
                 tilt * 180 / M_PI);
  metrics.counts.start_tilt_deg = tilt * 180 / M_PI;
}

}  // namespace lamina
