// Images and steps go side by side, by their stamps.
#include <lamina/pipeline/calibration/motion_refinement.hpp>

#include <fmt/format.h>

#include <cmath>

#include <lamina/frontend/motion/kidnap_detector.hpp>
#include <lamina/pipeline/calibration/camera/camera_hand_eye.hpp>
#include <lamina/pipeline/calibration/extrinsics.hpp>
#include <lamina/pipeline/calibration/wheel_intrinsics.hpp>
#include <lamina/sensors/depth_images.hpp>

namespace lamina {

namespace {

struct ObservedMotions {
  std::vector<std::optional<Increment>> motions;  // of the steps, where images tell them
  std::vector<LeftToWheels> left_to_wheels;       // where they were asked
  std::vector<std::size_t> carried;               // steps from one place to another
  std::optional<CorrectedMounting> mounting;
  MountingEvidence of_mounting;
  AgainstWheels against;
};

ObservedMotions look(Recording& recording, const DepthDistortion& distortion,
                     const std::vector<Step>& steps, const std::function<bool()>& ended) {
  DepthOdometry odometry;
  CameraAgainstWheels camera(camera_place(steps), odometry.options());
  ObservedMotions observed{std::vector<std::optional<Increment>>(steps.size()),
                           std::vector<LeftToWheels>(steps.size()),
                           {},
                           {},
                           {},
                           {}};
  MotionBesideWheels beside;
  PlaceWatch place;
  std::vector<std::size_t> seen;  // the images' steps
  std::size_t i = 0;
  bool follows = false;  // the image of the step before was seen
  while (!ended()) {
    auto frame = next_depth_image(recording, 0);
    if (!frame) break;
    const std::size_t before = i;
    while (i < steps.size() && steps[i].observations.stamp < frame->stamp) ++i;
    if (i == steps.size() || frame->stamp < steps[i].observations.stamp) continue;
    follows = follows && i <= before;
    const Step& step = steps[i];
    distortion.correct(*frame);
    frame->camera.camera.T_body_camera = step.observations.T_body_sensor;
    const Increment& wheels = step.motion;
    const MotionGuess guess{wheels.T_from_to, wheels.covariance};
    const DepthMotion motion = odometry.process(*frame, guess);
    const bool known = follows && observed_by_wheels(step);
    if (known) observed.motions[i] = beside.add(frame->stamp, motion);
    if (known) observed.left_to_wheels[i] = left_to_wheels(motion, guess);
    camera.add(frame->stamp, known ? std::optional(wheels) : std::nullopt, motion);
    if (!known) place = PlaceWatch();
    seen.push_back(i);
    if (const auto ago = place.add(*frame, motion.T_prev_curr_body, wheels.T_from_to))
      observed.carried.push_back(seen[seen.size() - 1 - *ago]);
    follows = true;
    ++i;
  }
  observed.mounting = camera.correction();
  observed.of_mounting = camera.evidence();
  observed.against = beside.against();
  return observed;
}

}  // namespace

std::optional<Increment> MotionBesideWheels::add(Timestamp stamp, const DepthMotion& motion) {
  const bool all = motion.status == ScanMotion::Status::kTracked && !motion.doubtful;
  const bool some = motion.status == ScanMotion::Status::kDegenerate && !motion.doubtful;
  Increment increment{motion.T_prev_curr_body, motion.covariance};
  if (motion.against_wheels_m > 0) {
    const double metres = motion.against_wheels_m, radians = motion.against_wheels_rad;
    if (against_.images++ == 0) against_.first = stamp;
    against_.last = stamp;
    against_.metres += metres;
    against_.radians += radians;
    off_ << metres, metres, 0, 0, 0, radians;
  } else if (all) {
    off_.setZero();
  } else {  // what this image leaves open wheels that were wrong just now do not tell
    increment.covariance.diagonal() += off_.cwiseAbs2();
  }
  return all || some || !off_.isZero() ? std::optional(increment) : std::nullopt;
}

void tell_against_wheels(const AgainstWheels& against, Diagnostics& metrics) {
  constexpr double kNoSlip = 0.5;  // m or rad in sum
  if (!(against.metres > kNoSlip || against.radians > kNoSlip)) return;
  metrics.warn(
      "odometry_contradicted",
      fmt::format(
          "{} images from {:.1f} to {:.1f} s tell clearly another motion than the odometry, "
          "which is {:.1f} m and {:.0f} degrees off there in sum: wheels that slip, stand "
          "still or count wrong. Taken from the images, but what they leave open there is a "
          "guess",
          against.images, against.first.seconds(), against.last.seconds(), against.metres,
          against.radians * 180 / M_PI));
}

MotionsByImages refine_motions_by_images(const OpenRecording& open,
                                         const DepthDistortion& distortion,
                                         std::vector<Step>& steps, bool remounting,
                                         const std::function<bool()>& ended) {
  ObservedMotions observed = look(*open(), distortion, steps, ended);
  MotionsByImages result;
  if (remounting && observed.mounting && one_kind_of_camera(steps) && !ended()) {
    result.mounting = observed.mounting;
    for (Step& step : steps) apply_correction(step, observed.mounting->correction);
    observed = look(*open(), distortion, steps, ended);
  }
  result.left = observed.of_mounting;
  result.against = observed.against;
  for (const std::size_t i : observed.carried) steps[i].tracking_lost = true;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    steps[i].left_to_wheels = observed.left_to_wheels[i];
    if (!observed.motions[i]) continue;
    steps[i].motion = *observed.motions[i];
    ++result.observed;
  }
  return result;
}

}  // namespace lamina
