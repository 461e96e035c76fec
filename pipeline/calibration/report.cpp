// Corrections, told in degrees and centimetres.
#include <lamina/pipeline/calibration/report.hpp>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include <lamina/models/error.hpp>
#include <lamina/models/median.hpp>
#include <lamina/pipeline/calibration/calibration_report.hpp>
#include <lamina/pipeline/calibration/camera/image_turns.hpp>
#include <lamina/pipeline/calibration/extrinsics.hpp>
#include <lamina/pipeline/calibration/floor_below.hpp>
#include <lamina/pipeline/calibration/ground_lean.hpp>
#include <lamina/pipeline/calibration/log.hpp>
#include <lamina/pipeline/calibration/sensor_changes.hpp>
#include <lamina/pipeline/calibration/slope_refinement.hpp>
#include <lamina/pipeline/calibration/wheel_intrinsics.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;

void tell(const CorrectedMounting& one, Diagnostics& metrics) {
  const Eigen::Vector3d degrees = one.correction.rotation_body / kDegree;
  const Eigen::Vector3d cm = 100 * one.correction.translation_body;
  run_log().info("corrected: {} mounting by {}", one.sensor, one.source);
  const char* const turns[] = {"roll", "pitch", "yaw"};
  for (int k = 0; k < 3; ++k) {
    const char axis = "xyz"[k];
    if (degrees(k) != 0)
      report_change(fmt::format("{}.{}_error_deg", one.sensor, turns[k]), 0, -degrees(k),
                    one.sigma_turn(k) / kDegree, metrics, one.score);
    if (cm(k) != 0)
      report_change(fmt::format("{}.{}_error_cm", one.sensor, axis), 0, -cm(k),
                    100 * one.sigma_move(k), metrics, one.score);
    metrics.counts.of(one.sensor).turned_deg[k] += degrees(k);
    metrics.counts.of(one.sensor).moved_cm[k] += cm(k);
  }
}

// A scan and how the body came to it from the one before.
struct ScanOnWay {
  const LaserScan& scan;
  std::optional<SE3> moved;  // by wheels, or where they never moved by matching; nullopt: unknown
  bool sure;                 // in all directions
  bool finely;               // by wheels that were read several times in between
};

// Gives the scans of level scanners in turn, until `take` returns false.
void follow_level_scans(Recording& recording, const ScanOdometryOptions& options,
                        const std::function<bool()>& ended,
                        const std::function<bool(const ScanOnWay&)>& take) {
  constexpr double kApart = 0.035;  // s
  WheelTrack wheels(recording.calibration().odometry);
  ScanOdometry matching(options);
  std::optional<Timestamp> last;
  try {
    while (!ended()) {
      const auto measurement = recording.next_light();
      if (!measurement) break;
      if (const auto* odometry = std::get_if<Odometry>(&*measurement)) wheels.add(*odometry);
      const auto* scan = std::get_if<LaserScan>(&*measurement);
      if (!scan || !is_level(scan->lidar.T_body_lidar, options.max_tilt)) continue;
      // A faster scanner's every scan says little more than every second one.
      if (last && !(scan->stamp - *last > kApart)) continue;
      ScanOnWay on_way{*scan, std::nullopt, false, false};
      if (wheels.moved()) {
        const auto way = last ? wheels.between(*last, scan->stamp) : std::nullopt;
        if (way) on_way.moved = way->T_from_to;
        on_way.sure = way.has_value();
        on_way.finely = way && wheels.several_within(*last, scan->stamp);
      } else {
        const ScanMotion way = matching.process(*scan);
        if (way.status != ScanMotion::Status::kPredicted) on_way.moved = way.T_prev_curr_body;
        on_way.sure = way.status == ScanMotion::Status::kTracked;
      }
      if (!take(on_way)) break;
      last = scan->stamp;
      wheels.forget_before(scan->stamp);
    }
  } catch (const Error&) {  // the run itself comes to it, and says so
  }
}

}  // namespace

namespace {

// Images that have the way longer than wheels and the floor as much lower than their camera's
// stated height: one wrong depth explains both.
std::optional<Warning> wrong_depth(const std::vector<Step>& steps, const Calibration& stated,
                                   double way_ratio) {
  std::vector<double> heights;
  for (const Step& step : steps) {
    const SE3 T_levelled_camera = step.T_body_levelled.inverse() * step.observations.T_body_sensor;
    if (const auto floor = floor_below(step, T_levelled_camera.so3(), SensorChangeOptions().level))
      heights.push_back(-floor->rho());
  }
  const CameraModel* camera = stated.depth_camera    ? &stated.depth_camera->camera
                              : stated.stereo_camera ? &stated.stereo_camera->camera
                                                     : nullptr;
  const double stated_height = camera ? camera->T_body_camera.translation().z() : 0;
  if (heights.empty() || !(stated_height > 0)) return std::nullopt;
  const double height = median(heights);
  if (std::abs(height / stated_height / way_ratio - 1) > 2 * WheelScale::kPrior)
    return std::nullopt;
  return Warning{
      "depth_scale",
      fmt::format("depths are {:.3f} times the true ones: the floor lies {:.3f} m below the camera "
                  "instead of the {:.3f} m of its mounting, and images have the way {:.3f} times "
                  "as long as the wheels. Wheels were left as they are, walls stand as much too "
                  "far: divide depths by that (depth_scale, or baseline or fx of a stereo camera)",
                  height / stated_height, height, stated_height, way_ratio)};
}

}  // namespace

std::optional<Eigen::Vector3d> correct_wheels(std::vector<Step>& steps, const Calibration& stated,
                                              const MapperOptions& options, bool remounting,
                                              Diagnostics& metrics,
                                              const std::function<bool()>& ended) {
  if (!wheels_and_images_alone(steps)) return std::nullopt;
  const auto timer = metrics.time("wheels");
  const auto found = calibrate_wheels(steps, options, remounting, ended);
  if (!found) return std::nullopt;
  const WheelErrors::Vector& value = found->errors.value;
  const WheelErrors::Vector sigma = found->errors.covariance.diagonal().cwiseSqrt();
  const double turned = found->cameras.rotation_body.z() / kDegree;
  const Eigen::Vector2d cm = 100 * found->cameras.translation_body.head<2>();
  const auto tell_one = [&](const char* parameter, double nominal, int k, double unit) {
    const Estimate one{parameter, nominal, nominal + value(k) / unit, sigma(k) / unit,
                       found->adoption};
    report(one, metrics);
  };
  tell_one("odometry.scale", 1, 0, 1);
  tell_one("odometry.drift_deg_per_m", 0, 1, kDegree);
  tell_one("odometry.turn_scale", 1, 2, 1);
  tell_one("camera.yaw_error_deg", 0, 3, kDegree);
  if (!found->adoption.adopted) return std::nullopt;
  if (std::abs(value(0)) > 4 * WheelScale::kPrior) {
    if (const auto depth = wrong_depth(steps, stated, 1 + value(0))) {
      metrics.warn(depth->id, depth->text);
      for (CalibrationEntry& entry : metrics.calibration)
        if (entry.parameter.rfind("odometry.", 0) == 0) entry.adopted = false;
      return std::nullopt;
    }
    metrics.warn("wheel_scale",
                 fmt::format("images have the way {:.0f} % longer than the wheels: check units, "
                             "wheels and depth_scale; corrected, as nothing else tells the way",
                             100 * value(0)));
  }
  apply_correction(steps, *found);
  metrics.counts.wheel_scale_correction = value(0);
  metrics.counts.wheel_drift_correction_deg_per_m = value(1) / kDegree;
  metrics.counts.wheel_turn_correction = value(2);
  metrics.counts.camera.turned_deg[2] += turned;
  metrics.counts.camera.moved_cm[0] += cm.x();
  metrics.counts.camera.moved_cm[1] += cm.y();
  return sigma.head<3>();
}

namespace {

void warn_of_place(const MountingContradiction& c, Diagnostics& metrics) {
  const char* const done = "not corrected: too little of the recording confirms it";
  const char* const moved = c.cameras_too ? "corrected, cameras with it" : "corrected";
  metrics.warn("lidar_mounting",
               fmt::format("turns contradict the lidar's stated place (T_body_lidar, x {:.2f} y "
                           "{:.2f} m): by its scans and the wheels it is x {:.2f} (+-{:.2f}) y "
                           "{:.2f} (+-{:.2f}) m from the point that the odometry turns about; {}",
                           c.stated.x(), c.stated.y(), c.found.x(), c.sigma.x(), c.found.y(),
                           c.sigma.y(), c.corrected ? moved : done));
}

// No robot carries a scanner higher than it can measure.
void warn_of_height(const std::vector<Step>& steps, Diagnostics& metrics) {
  const auto high = std::find_if(steps.begin(), steps.end(), [](const Step& step) {
    return step.scan && step.scan->range_max > 0 &&
           std::abs(step.scan->lidar.T_body_lidar.translation().z()) > step.scan->range_max;
  });
  if (high == steps.end()) return;
  metrics.warn(
      "lidar_mounting",
      fmt::format("the lidar's stated height (T_body_lidar, z {:.1f} m) is beyond its own "
                  "range ({:.1f} m): the map stands at that height; is it in metres?",
                  high->scan->lidar.T_body_lidar.translation().z(), high->scan->range_max));
}

}  // namespace

MountingEvidence correct_mountings(std::vector<Step>& steps, std::vector<LoopClosure>& loops,
                                   bool planar, Diagnostics& metrics) {
  const MountingCalibration found = calibrate_mountings(steps, loops, planar);
  for (const CorrectedMounting& one : found.corrected) tell(one, metrics);
  warn_of_height(steps, metrics);
  if (found.contradiction) warn_of_place(*found.contradiction, metrics);
  return found.left;
}

std::optional<MountingCorrection> find_lean(Recording& recording,
                                            const ScanOdometryOptions& options,
                                            Diagnostics& metrics,
                                            const std::function<bool()>& ended) {
  if (!recording.calibration().odometry.planar) return std::nullopt;
  GroundLean lean;
  bool may_tell = true;
  follow_level_scans(recording, options, ended, [&](const ScanOnWay& on_way) {
    may_tell = GroundLean::may_tell(on_way.scan);
    if (!may_tell) return false;
    lean.add(on_way.scan, on_way.moved && on_way.sure ? on_way.moved->so3().yaw() : 0);
    return lean.wants_more();
  });
  if (!may_tell) return std::nullopt;
  if (ended()) return std::nullopt;
  const auto found = lean.correction();
  if (found) tell({"scanner", "ground", *found}, metrics);
  return found;
}

void tell_sweep(const SweepFinder::Found& found, Diagnostics& metrics) {
  if (report({"lidar.sweep_s", 0, found.sweep, found.sigma, found.adoption}, metrics))
    metrics.counts.scanner_sweep_ms = 1000 * found.sweep;
}

Sweep find_sweep(Recording& recording, const ScanOdometryOptions& options,
                 const std::function<bool()>& ended) {
  SweepWatch watch;
  bool stated = false;
  follow_level_scans(recording, options, ended, [&](const ScanOnWay& on_way) {
    stated = on_way.scan.time_increment > 0;
    if (stated) return false;
    watch.add(on_way.scan, on_way.moved, on_way.finely);
    return watch.wants_more();
  });
  if (stated) return {true, {}};
  return {false, ended() ? std::nullopt : watch.found()};
}

std::optional<WheelScale::Found> find_wheel_scale(Recording& recording,
                                                  const CalibrationOptions& settings,
                                                  const FrontEnd& observed,
                                                  const std::function<bool()>& ended) {
  if (!recording.calibration().odometry.planar) return std::nullopt;
  constexpr int kMostWithoutWheels = 100;  // scans
  int without = 0;
  WheelScale scale(recording.calibration().odometry);
  Diagnostics of_look;
  FrontEnd front_end(settings, recording.calibration());
  front_end.motion().look_by_scans(observed.motion());
  try {
    while (!ended() && without < kMostWithoutWheels && !scale.has_enough()) {
      const auto measurement = recording.next_light();
      if (!measurement) break;
      const auto* scan = std::get_if<LaserScan>(&*measurement);
      if (scan && !is_level(scan->lidar.T_body_lidar, settings.scan_odometry.max_tilt)) continue;
      if (!scan && !std::holds_alternative<Odometry>(*measurement)) continue;
      const auto step = front_end.process(*measurement, of_look);
      if (!step || !step->scan_motion) continue;
      without = step->wheels_moved ? 0 : without + 1;
      scale.add(scan->stamp, step->wheels_moved, step->scan_motion->by_scans_alone);
    }
  } catch (const Error&) {  // the run itself comes to it, and says so
  }
  const auto found = scale.found();
  if (ended() || !found) return std::nullopt;
  if (recording.calibration().depth_camera && !scale.beyond_noise(*found)) return std::nullopt;
  return found;
}

namespace {

// Beyond four sigmas of what wheels usually err by: by way alone, ranges are as likely.
void warn_of_scale(const WheelScale::Found& found, bool used, Diagnostics& metrics) {
  const double scale = found.scale, sigma = found.sigma;
  const double bound = 4 * WheelScale::kPrior * std::abs(1 + scale) + 2 * sigma;
  if (!(std::abs(scale) > bound && found.adoption.gain > AdoptionOptions().least_gain)) return;
  const double percent = 100 * scale, ranges = 100 * (1 + scale);
  metrics.warn(
      "wheel_scale",
      fmt::format("the way by scans is {:.1f} % (+-{:.1f}) {} than the wheels': either the wheels' "
                  "scale is wrong (wheel radius, counts per metre), or the scanner's ranges are "
                  "({:.1f} % of the true ones), which scans and wheels alone do not show. {}; "
                  "if it is the ranges, the map is as much too {}: measure a wall of it",
                  std::abs(percent), 100 * sigma, scale > 0 ? "longer" : "shorter", ranges,
                  used ? "The wheels are corrected" : "Neither is corrected",
                  scale > 0 ? "large" : "small"));
}

}  // namespace

bool tell_wheel_scale(const WheelScale::Found& found, bool without, Diagnostics& metrics) {
  // Of the wheels themselves, and not by chance.
  const double bound = WheelScale::kBound * std::abs(1 + found.scale) + 2 * found.sigma;
  const Estimate estimate{"odometry.scale", 1, 1 + found.scale, found.sigma, found.adoption, bound};
  const bool within =
      report(estimate, metrics, "wheel_scale",
             !found.is_one()
                 ? "nothing was corrected: a wheel's scale does not scatter, scans that meet the "
                   "ground or follow what moves do; what they show may be wrong"
             : without ? "the wheels' scale or the scanner's ranges; the map is made by "
                         "scans alone, without the wheels: measure a wall of it"
                       : "the wheels' scale or the scanner's ranges; taken out all the "
                         "same, as scans do not hold the path: measure a wall of it");
  const bool used = found.adoption.adopted && (within || (!without && found.is_one()));
  for (CalibrationEntry& entry : metrics.calibration) {
    if (entry.parameter == estimate.parameter) entry.adopted = used;
  }
  if (std::abs(found.scale) <= bound) warn_of_scale(found, used, metrics);
  if (used) metrics.counts.wheel_scale_correction = found.scale;
  return used;
}

WheelTrack all_wheels(Recording& recording, const std::function<bool()>& ended) {
  return wheels_of(recording, ended).track;
}

bool lift_off_plane(const OpenRecording& open, const DepthDistortion& distortion,
                    std::vector<Step>& steps, Diagnostics& metrics,
                    const std::function<bool()>& ended) {
  const bool scans = std::any_of(steps.begin(), steps.end(),
                                 [](const Step& step) { return step.scan_motion.has_value(); });
  if (!scans) return false;
  const auto timer = metrics.time("slopes");
  const SlopesByImages found = follow_slopes(open, distortion, steps, ended);
  if (found.observed == 0) return false;
  run_log().info(
      "slopes followed by {} images: tilt up to {:.1f} deg, height from {:.2f} to {:.2f} m",
      found.observed, found.most_tilt / kDegree, found.lowest, found.highest);
  metrics.counts.slopes_by_images = found.observed;
  return true;
}

MountingEvidence correct_motions_by_images(const OpenRecording& open,
                                           const DepthDistortion& distortion,
                                           std::vector<Step>& steps, bool remounting,
                                           Diagnostics& metrics,
                                           const std::function<bool()>& ended) {
  if (!wheels_and_images_alone(steps)) return {};
  const auto timer = metrics.time("images_beside_wheels");
  const MotionsByImages found =
      refine_motions_by_images(open, distortion, steps, remounting, ended);
  metrics.counts.motions_by_images = found.observed;
  tell_against_wheels(found.against, metrics);
  if (found.mounting) tell(*found.mounting, metrics);
  return found.left;
}

}  // namespace lamina
