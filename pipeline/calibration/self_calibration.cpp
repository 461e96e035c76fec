// One look after the other, each with what those before it found.
#include <lamina/pipeline/calibration/self_calibration.hpp>

#include <atomic>
#include <future>

#include <lamina/pipeline/calibration/camera/depth_calibration.hpp>
#include <lamina/pipeline/calibration/camera/depth_intrinsics.hpp>
#include <lamina/pipeline/calibration/initial_attitude.hpp>
#include <lamina/pipeline/calibration/report.hpp>
#include <lamina/pipeline/calibration/scanner_calibration.hpp>

namespace lamina {
namespace {

// The look for the wheels' scale, in a thread of its own, while those that come before it go on:
// mostly these find nothing that it would have to know.
class EarlyLook {
 public:
  explicit EarlyLook(const Rereadable& input)
      : observed_(input.settings, input.recording->calibration()), recording_(input.open_again()) {
    found_ = std::async(std::launch::async, [this, &input] {
      return find_wheel_scale(*recording_, input.settings, observed_,
                              [this, &input] { return in_vain_ || input.ended(); });
    });
  }
  ~EarlyLook() { in_vain_ = true; }  // and the future waits
  std::optional<WheelScale::Found> found() { return found_.get(); }

 private:
  std::atomic<bool> in_vain_ = false;
  const FrontEnd observed_;  // nothing
  std::unique_ptr<Recording> recording_;
  std::future<std::optional<WheelScale::Found>> found_;
};

// The looks of one recording, in their order.
class SelfCalibration {
 public:
  SelfCalibration(const Rereadable& input, FrontEnd& front_end)
      : input_(input),
        settings_(input.settings),
        metrics_(input.metrics),
        front_end_(front_end),
        depth_(input.recording->calibration().depth_camera.has_value()),
        planar_(input.recording->calibration().odometry.planar),
        sweep_{input.settings.sweep != 0, {}} {}

  void look() {
    if (planar_ && input_.recording->calibration().lidar) at_scanner();
    if (settings_.calibrate_depth && depth_) at_depth();
    if (settings_.calibrate_wheels && settings_.threads > 1 && planar_ && !depth_ && !sweep_.stated)
      early_.emplace(input_);
    at_sweep_and_clocks();
    at_start();
    if (settings_.calibrate_depth && settings_.calibrate_wheels && depth_) at_slopes();
    if (start_) {
      tell_start(*start_, metrics_);
      front_end_.begin_tilted(*start_);
    }
    if (sweep_.adopted() || sweep_.stated) {
      early_.reset();
      one("scanner_sweep", [&](Recording& all) {
        front_end_.motion().wheels().use_whole(all_wheels(all, input_.ended));
      });
    }
    if (settings_.calibrate_mountings) at_lean();
    if (settings_.calibrate_wheels) at_wheels();
  }

 private:
  // Reads the recording, and opens it again.
  template <class At>
  void one(const char* stage, const At& at) {
    const auto timer = metrics_.time(stage);
    at(*input_.recording);
    input_.recording.reset();
    input_.recording = input_.open_again();
  }

  void at_scanner() {
    std::optional<ScannerCheck::Found> found;
    one("scanner_check",
        [&](Recording& all) { found = check_scanner(all, settings_, input_.ended); });
    if (!found) return;
    if (!found->changes.empty()) {
      one("scanner_check",
          [&](Recording& all) { place_changes(all, settings_, *found, input_.ended); });
    }
    report_scanner(*found, input_.recording->calibration(), settings_.calibrate_mountings,
                   metrics_);
    if (!settings_.calibrate_mountings) return;
    input_.scanner = found->correction;
    for (Stretch& part : input_.scanner.reversed) {  // of scans whose clocks are not corrected yet
      part.from = part.from + -input_.clocks.scanner;
      if (part.until) part.until = *part.until + -input_.clocks.scanner;
    }
    input_.recording.reset();
    input_.recording = input_.open_again();
  }

  void at_depth() {
    one("depth_calibration", [&](Recording& all) {
      const SE3 T_body_camera = all.calibration().depth_camera->camera.T_body_camera;
      const DepthCalibration found = calibrate_depth(all, settings_.floor, metrics_, input_.ended);
      front_end_.correct_depth(found.bend);
      if (found.ground) front_end_.expect_ground(*found.ground);
      if (planar_ && settings_.floor.self_calibrate && found.mounting)
        front_end_.begin_with_mounting(T_body_camera, *found.mounting);
    });
  }

  // Half of a sweep left in is an offset, and velocities of another instant hide a sweep.
  void at_sweep_and_clocks() {
    constexpr int kRounds = 3;
    at_sweep();
    for (int round = 0; round < kRounds && at_clocks(); ++round) {
      early_.reset();
      at_sweep();
      if (!sweep_.adopted()) break;
    }
    if (sweep_.found) tell_sweep(*sweep_.found, metrics_);
    if (sweep_.adopted()) front_end_.motion().scan_duration().set(sweep_.found->sweep);
  }

  void at_sweep() {
    if (sweep_.stated || !settings_.find_sweep) return;
    one("scanner_sweep",
        [&](Recording& all) { sweep_ = find_sweep(all, settings_.scan_odometry, input_.ended); });
  }

  // Whether clocks were corrected.
  bool at_clocks() {
    if (!settings_.find_clocks || !input_.recording->calibration().odometry.planar) return false;
    const auto timer = metrics_.time("clocks");
    input_.recording.reset();
    const std::optional<double> found =
        sweep_.adopted() ? std::optional(sweep_.found->sweep) : std::nullopt;
    const bool corrected = correct_clocks(input_.clocks, input_.open_reclocked, settings_, found,
                                          front_end_.depth_distortion(), metrics_, input_.ended);
    input_.recording = input_.open_again();
    return corrected;
  }

  void at_start() {
    if (!settings_.floor.self_calibrate || !depth_ || !planar_) return;
    WheelTrack wheels(input_.recording->calibration().odometry);
    one("tilted_start", [&](Recording& all) { wheels = all_wheels(all, input_.ended); });
    one("tilted_start", [&](Recording& all) {
      start_ = find_tilted_start(all, wheels, settings_.floor, front_end_.depth_distortion(),
                                 input_.ended);
    });
  }

  void at_slopes() {
    one("depth_slopes", [&](Recording& all) {
      auto with_slopes = find_depth_slopes(all, settings_, front_end_.depth_distortion(), start_,
                                           metrics_, input_.ended);
      if (with_slopes) front_end_.correct_depth(std::move(*with_slopes));
    });
    if (start_) at_start();  // slopes turn floors
  }

  void at_lean() {
    one("scanner_lean", [&](Recording& all) {
      const auto lean = find_lean(all, settings_.scan_odometry, metrics_, input_.ended);
      if (!lean) return;
      early_.reset();
      front_end_.motion().correct_level_scanner(*lean);
    });
  }

  void at_wheels() {
    std::optional<WheelScale::Found> scale;
    if (early_) {
      const auto timer = metrics_.time("wheel_scale");
      scale = early_->found();
    } else {
      one("wheel_scale", [&](Recording& all) {
        scale = find_wheel_scale(all, settings_, front_end_, input_.ended);
      });
    }
    if (!scale) return;
    // Scans that hold (nearly) all of the path bear the map without wheels that are plainly wrong.
    constexpr double kHeld = 0.95;
    const bool without = scale->held >= kHeld && scale->is_one();
    if (tell_wheel_scale(*scale, without, metrics_)) {
      front_end_.motion().wheels().begin(scale->scale, scale->sigma);
    } else if (scale->adoption.adopted && without) {
      front_end_.motion().wheels().leave();
    }
  }

  const Rereadable& input_;
  const CalibrationOptions& settings_;
  Diagnostics& metrics_;
  FrontEnd& front_end_;
  const bool depth_, planar_;
  Sweep sweep_;
  std::optional<EarlyLook> early_;
  std::optional<TiltedStart> start_;
};

}  // namespace

void self_calibrate(const Rereadable& input, FrontEnd& front_end) {
  SelfCalibration(input, front_end).look();
}

}  // namespace lamina
