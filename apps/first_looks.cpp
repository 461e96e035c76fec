// One look after the other, each with what those before it found.
#include <lamina/apps/first_looks.hpp>

#include <atomic>
#include <future>

#include <lamina/apps/calibration.hpp>
#include <lamina/apps/depth_calibration.hpp>
#include <lamina/apps/depth_slopes.hpp>
#include <lamina/apps/scanner_calibration.hpp>
#include <lamina/apps/start_calibration.hpp>

namespace lamina::apps {
namespace {

// The look for the wheels' scale, in a thread of its own, while those that come before it go on:
// mostly these find nothing that it would have to know.
class EarlyLook {
 public:
  explicit EarlyLook(const Rereadable& input)
      : told_(input.settings, input.recording->calibration()), recording_(input.open_again()) {
    found_ = std::async(std::launch::async, [this, &input] {
      return find_wheel_scale(*recording_, input.settings, told_,
                              [this, &input] { return in_vain_ || input.ended(); });
    });
  }
  ~EarlyLook() { in_vain_ = true; }  // and the future waits
  std::optional<WheelScale::Found> found() { return found_.get(); }

 private:
  std::atomic<bool> in_vain_ = false;
  const FrontEnd told_;  // nothing
  std::unique_ptr<Recording> recording_;
  std::future<std::optional<WheelScale::Found>> found_;
};

}  // namespace

void look_ahead(const Rereadable& input, FrontEnd& front_end) {
  const Settings& settings = input.settings;
  io::Metrics& metrics = input.metrics;
  const bool depth = input.recording->calibration().depth_camera.has_value();
  const bool planar = input.recording->calibration().odometry.planar;
  const auto look = [&](const char* stage, const auto& at) {
    const auto timer = metrics.time(stage);
    at(*input.recording);
    input.recording.reset();
    input.recording = input.open_again();
  };
  const bool scanner = input.recording->calibration().lidar.has_value();
  if (scanner && planar)
    look("scanner_check", [&](Recording& all) {
      const auto found = check_scanner(all, settings, input.ended);
      if (!found) return;
      report_scanner(*found, all.calibration(), settings.calibrate_mountings, metrics);
      if (settings.calibrate_mountings) input.scanner = found->correction;
    });
  if (settings.calibrate_depth && depth) {
    look("depth_calibration", [&](Recording& all) {
      const SE3 T_body_camera = all.calibration().depth_camera->camera.T_body_camera;
      const DepthCalibration found = calibrate_depth(all, settings.floor, metrics, input.ended);
      front_end.correct_depth(found.bend);
      if (planar && settings.floor.self_calibrate && found.mounting) {
        front_end.begin_remounted(T_body_camera, *found.mounting);
      }
    });
  }
  Sweep sweep{settings.sweep != 0, {}};
  std::optional<EarlyLook> early;
  if (settings.calibrate_wheels && settings.threads > 1 && planar && !depth && !sweep.stated)
    early.emplace(input);
  const auto look_for_sweep = [&] {
    if (settings.sweep != 0 || !settings.find_sweep || sweep.stated) return;
    look("scanner_sweep",
         [&](Recording& all) { sweep = find_sweep(all, settings.scan_odometry, input.ended); });
  };
  const auto look_for_clocks = [&] {
    if (!settings.find_clocks || !input.recording->calibration().odometry.planar) return false;
    const auto timer = metrics.time("clocks");
    input.recording.reset();
    const std::optional<double> found =
        sweep.adopted() ? std::optional(sweep.found->sweep) : std::nullopt;
    const bool corrected = correct_clocks(input.clocks, input.open_reclocked, settings, found,
                                          front_end.depth_distortion(), metrics, input.ended);
    input.recording = input.open_again();
    return corrected;
  };
  // Half of a sweep left in is an offset, and velocities of another instant hide a sweep.
  constexpr int kRounds = 3;
  look_for_sweep();
  for (int round = 0; round < kRounds && look_for_clocks(); ++round) {
    early.reset();
    look_for_sweep();
    if (!sweep.adopted()) break;
  }
  if (sweep.found) tell_sweep(*sweep.found, metrics);
  if (sweep.adopted()) front_end.set_sweep(sweep.found->sweep);
  std::optional<TiltedStart> start;
  const auto look_at_start = [&] {
    if (!settings.floor.self_calibrate || !depth || !planar) return;
    WheelTrack wheels(input.recording->calibration().odometry);
    look("tilted_start", [&](Recording& all) { wheels = all_wheels(all, input.ended); });
    look("tilted_start", [&](Recording& all) {
      start =
          find_tilted_start(all, wheels, settings.floor, front_end.depth_distortion(), input.ended);
    });
  };
  look_at_start();
  if (settings.calibrate_depth && settings.calibrate_wheels && depth) {
    look("depth_slopes", [&](Recording& all) {
      auto with_slopes = find_depth_slopes(all, settings, front_end.depth_distortion(), start,
                                           metrics, input.ended);
      if (!with_slopes) return;
      front_end.correct_depth(std::move(*with_slopes));
    });
    if (start) look_at_start();  // slopes turn floors
  }
  if (start) {
    tell_start(*start, metrics);
    front_end.begin_tilted(*start);
  }
  if (sweep.adopted() || sweep.stated) {
    early.reset();
    look("scanner_sweep",
         [&](Recording& all) { front_end.look_ahead(all_wheels(all, input.ended)); });
  }
  if (settings.calibrate_mountings) {
    look("scanner_lean", [&](Recording& all) {
      const auto lean = find_lean(all, settings.scan_odometry, metrics, input.ended);
      if (!lean) return;
      early.reset();
      front_end.correct_level_scanner(*lean);
    });
  }
  if (!settings.calibrate_wheels) return;
  std::optional<WheelScale::Found> scale;
  if (early) {
    const auto timer = metrics.time("wheel_scale");
    scale = early->found();
  } else {
    look("wheel_scale",
         [&](Recording& all) { scale = find_wheel_scale(all, settings, front_end, input.ended); });
  }
  if (!scale) return;
  // Scans that hold (nearly) all of the path bear the map without wheels that are plainly wrong.
  constexpr double kHeld = 0.95;
  const bool without = scale->held >= kHeld;
  if (tell_wheel_scale(*scale, without, metrics)) {
    front_end.begin_wheels(*scale);
  } else if (scale->adoption.adopted && without) {
    front_end.leave_wheels();
  }
}

}  // namespace lamina::apps
