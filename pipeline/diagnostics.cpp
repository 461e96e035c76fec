// From counts of a run to sentences.
#include <lamina/pipeline/diagnostics.hpp>

#include <fmt/format.h>
#include <algorithm>

namespace lamina {
namespace {

// What calibration.yaml says of the depth camera, against what its images show.
void add_warnings_of_depth(const FrontEnd& front_end, std::vector<Warning>& all) {
  if (const OpticalWatch& optical = front_end.depth_checks().optical; optical.rotation_missing()) {
    all.push_back(
        {"camera_optical_rotation",
         fmt::format(
             "T_body_camera turns nothing, so that the camera looks along the body's z, straight "
             "up: {} "
             "of {} images show a floor so, {} if it looks ahead, {:.2f} m below it. Its optical "
             "rotation (x right, y down, z ahead) seems to be missing: looking straight ahead it "
             "is "
             "rotation_xyzw: [-0.5, 0.5, -0.5, 0.5]; the map is of little use without",
             optical.floors_as_stated(), optical.images(), optical.floors_if_ahead(),
             optical.height_if_ahead())});
  }
  constexpr std::int64_t kImages = 10;  // fewer tell little
  constexpr double kNoisy = 1.5;        // quieter blocks of clean sensors are below the model
  const NoiseWatch& noise = front_end.depth_checks().noise;
  if (noise.images() < kImages) return;
  if (noise.median() >= kNoisy) {
    all.push_back(
        {"depth_noise",
         fmt::format(
             "noise of depth images is {:.1f} times what calibration.yaml says of the camera "
             "(median "
             "over {} images): is its `model` the sensor's own, and disparity_sigma? Obstacles and "
             "walls of the map are less sure than they say",
             noise.median(), noise.images())});
  }
}

// What is stated of the scanner's ranges, against how they scatter along lines.
void add_warnings_of_ranges(const RangeNoise& noise, const RangeCheck& check, bool noise_is_stated,
                            std::vector<Warning>& all) {
  if (const auto code = check.code()) {
    all.push_back({"no_return_code",
                   fmt::format("readings of {:.2f} m and more are what the scanner gives where "
                               "nothing returned (whole sectors have that one range), range_max "
                               "{:.2f} m is stated: they were taken as no return",
                               *code, check.stated())});
  }
  if (const auto from = check.noise_from()) {
    all.push_back(
        {"range_max",
         fmt::format("the scanner's returns from {:.1f} m on are noise ({:.0f} % of them "
                     "stand out from both neighbours, {:.0f} % of those before), range_max "
                     "{:.1f} m is stated: they were left out",
                     *from, 100 * check.share_beyond(), 100 * check.share_before(),
                     check.stated())});
  }
  if (const auto reach = check.reach()) {
    all.push_back(
        {"range_max", fmt::format("range_max {:.2f} m is stated, but the scanner measured "
                                  "walls up to {:.1f} m: all of them were used",
                                  check.stated(), *reach)});
  }
  constexpr double kFar = 3.5;  // times: rough walls and rounded ranges explain the rest
  const double stated = noise.stated(), used = noise.sigma();
  if (!noise_is_stated || !(stated > 0) || (used < kFar * stated && stated < kFar * used)) return;
  all.push_back(
      {"range_noise",
       fmt::format("lidar.range_sigma: {:.3g} m is stated, along straight walls ranges scatter by "
                   "{:.3f} m, which was used instead",
                   stated, used)});
}

constexpr double kLong = 0.5;  // m of open way in a row, or of way that wheels do not count

void add_warnings_of_odometry(const std::string& input, const FrontEnd& front_end,
                              Diagnostics& metrics, std::vector<Warning>& all) {
  const WheelMotion& wheels = front_end.motion().wheels();
  if (wheels.never_met()) {
    all.push_back(
        {"odometry_never_meets",
         fmt::format(
             "the odometry's stamps never meet those of frames and scans: motion was taken from "
             "what "
             "these see; are they of two clocks or two recordings? (`lamina info {}` tells)",
             input)});
  }
  if (wheels.never_moved() && metrics.counts.path_m > kLong) {
    all.push_back(
        {"odometry_never_moves", fmt::format("the odometry holds one pose from first to last while "
                                             "frames and scans tell {:.1f} m of way: it was "
                                             "not used for that; was it ever connected?",
                                             metrics.counts.path_m)});
  }
  const double steps = metrics.counts.steps;
  const double unknown = metrics.counts.steps_with_unknown_motion;
  if (steps > 1 && unknown > 0.5 * steps) {
    all.push_back(
        {"motion_unknown",
         fmt::format(
             "nothing measured the motion before {:.0f} of {:.0f} frames and scans: is there no "
             "odometry, or do its stamps not meet theirs? (`lamina info` tells)",
             unknown, steps)});
  }
}

void add_warnings_of_scans(Diagnostics& metrics, std::vector<Warning>& all) {
  constexpr double kLeftOut = 0.01;  // of the steps
  if (const double out = metrics.counts.scans_left_out; out > kLeftOut * metrics.counts.steps) {
    all.push_back({"scan_outliers",
                   fmt::format("{:.0f} scans fit nowhere while the wheels went on as before (the "
                               "robot tipped, or something covered the scanner): the motion there "
                               "is the wheels', and the scans are left out of the map",
                               out)});
  }
  if (const double way = metrics.counts.scans_open_direction_longest_m; way > kLong) {
    all.push_back(
        {"scans_open_direction", fmt::format("{:.0f} scans left a direction of their motion open "
                                             "and no wheels told it, over {:.1f} m "
                                             "of way in a row (a bare corridor, longer than the "
                                             "scanner sees): along it the path is a "
                                             "guess there, off by part of that way",
                                             metrics.counts.scans_with_open_direction, way)});
  }
}

void add_warnings_of_wheels_alone(Diagnostics& metrics, std::vector<Warning>& all) {
  // Planners leave a robot that much room. Where most of the way was seen, planes met again hold
  // much of the rest, and the figure is an upper bound.
  const bool most = metrics.counts.by_wheels_alone_m > 0.5 * metrics.counts.path_m;
  const double noticed = most ? 0.25 : 0.5;  // m
  if (const double off = metrics.counts.by_wheels_alone_sigma_m; off > noticed) {
    all.push_back({"path_by_wheels_alone",
                   fmt::format("wheels alone told {:.0f} of {:.0f} m of way (how long it was over "
                               "{:.1f} m, the heading "
                               "over {:.1f} m: what was seen left these open): by what is known of "
                               "the wheels the path "
                               "beyond is likely off by some {:.1f} m, and the map with it",
                               metrics.counts.by_wheels_alone_m, metrics.counts.path_m,
                               metrics.counts.way_by_wheels_alone_m,
                               metrics.counts.heading_by_wheels_alone_m, off)});
  }
  // Scale and noise of wheels are in that figure; slips are not, and where nothing else tells the
  // way nothing contradicts them.
  constexpr double kSlip = 0.02, kSlipNoticed = 0.25;  // share of the way, m
  const double alone = metrics.counts.way_by_wheels_alone_longest_m;
  if (kSlip * alone > kSlipNoticed) {
    all.push_back({"way_by_wheels_alone",
                   fmt::format("from {:.1f} to {:.1f} s nothing but wheels told how far the robot "
                               "went, over {:.1f} m (a "
                               "bare corridor or hall, longer than what was seen): a slip of "
                               "{:.0f} % there would put all "
                               "that follows {:.1f} m off, and nothing in the map would say so",
                               metrics.counts.way_by_wheels_alone_longest_from_s,
                               metrics.counts.way_by_wheels_alone_longest_to_s, alone, 100 * kSlip,
                               kSlip * alone)});
  }
}

void add_warnings_of_tracking(Diagnostics& metrics, std::vector<Warning>& all) {
  const double steps = metrics.counts.steps;
  if (!metrics.tracking_lost.empty()) {
    all.push_back(
        {"tracking_lost",
         fmt::format(
             "tracking was lost at {:.0f} of {:.0f} steps, first after {:.3f} s: the motion "
             "there is a guess, and parts of the map may not fit each other",
             metrics.counts.steps_with_tracking_lost, steps,
             metrics.counts.tracking_lost_after_s)});
  }
  const double open = metrics.counts.steps_with_open_direction;
  if (open > 0.5 * steps) {
    all.push_back(
        {"images_open_direction",
         fmt::format(
             "{:.0f} of {:.0f} images left a direction of their motion open (bare corridors, walls "
             "out "
             "of range): along it the path is a guess; wheel odometry or a scanner would tell",
             open, steps)});
  } else if (metrics.counts.open_direction_longest_m > kLong) {
    all.push_back(
        {"images_open_direction",
         fmt::format(
             "images left a direction of their motion open over {:.1f} m of way in a row (a bare "
             "wall, "
             "nothing else in range): along it the path is a guess there, off by part of that way",
             metrics.counts.open_direction_longest_m)});
  }
}

void add_warnings_of_floor(Diagnostics& metrics, std::vector<Warning>& all) {
  if (const double steps_open = metrics.counts.cells_step_open;
      steps_open > metrics.counts.cells_free) {
    all.push_back(
        {"range_noise_hides_steps",
         fmt::format("a step as high as the robot's largest (robot.max_step_m) cannot be told on "
                     "{:.0f} % of "
                     "the floor that was seen, which the grid calls unknown: range is too noisy "
                     "for it; images "
                     "from nearer by, more of them, or a robot that climbs more would make it free",
                     100 * steps_open / (steps_open + metrics.counts.cells_free))});
  }
}

}  // namespace

std::vector<Warning> result_warnings(const std::string& input, const FrontEnd& front_end,
                                     Diagnostics& metrics) {
  std::vector<Warning> all;
  add_warnings_of_odometry(input, front_end, metrics, all);
  add_warnings_of_scans(metrics, all);
  add_warnings_of_wheels_alone(metrics, all);
  add_warnings_of_tracking(metrics, all);
  add_warnings_of_floor(metrics, all);
  const bool noise_is_stated =
      std::none_of(metrics.assumed.begin(), metrics.assumed.end(),
                   [](const auto& text) { return text.find("lidar.range_sigma") == 0; });
  add_warnings_of_ranges(front_end.ranges().noise(), front_end.ranges().largest(), noise_is_stated,
                         all);
  add_warnings_of_depth(front_end, all);
  return all;
}

}  // namespace lamina
