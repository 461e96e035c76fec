// How the body moved where wheels say nothing: by images, or on as before, and when that is lost.
#include <algorithm>

#include <lamina/frontend/frontend.hpp>
#include <lamina/frontend/motion/motion_covariances.hpp>

namespace lamina {
namespace {

constexpr double kSurelyCoasted = 1;  // s: after that a robot that nothing tracks is lost

}  // namespace

// Where the chain of motions stands at a stamp by wheels alone. The map frame is the odometry
// frame: the first pose is the first odometry pose, also where that comes a little later.
SE3 FrontEnd::dead_reckoned(Timestamp stamp) const {
  if (!last_step_) {
    const SE3 T = wheels_.at(stamp).value_or(wheels_.empty() ? SE3() : wheels_.oldest());
    return T_level_start_ ? T * *T_level_start_ : T;
  }
  const auto moved = wheels_.between(*last_step_, stamp);
  return moved ? T_start_body_ * moved->T_from_to : T_start_body_;
}

// Nothing tells at this instant: on as the wheels drove before they stopped, as between the last
// two scans or over the last two images, the less sure the longer.
Increment FrontEnd::coast(Timestamp stamp) const {
  constexpr double kSurest = 1e-4, kShare = 0.5, kAcceleration = 1, kTurning = 2;  // m, rad, s
  if (!last_step_) return {T_start_body_.inverse() * dead_reckoned(stamp), still_covariance()};
  const double dt = stamp - *last_step_;
  if (!(stamp - last_observed_.value_or(*last_step_) < kSurelyCoasted))
    return {SE3(), any_motion()};  // long enough to have gone anywhere
  std::optional<Vector6d> velocity = wheels_.velocity(*last_step_, stamp);
  if (scan_interval_ > 0 && !velocity) velocity = scan_step_.log() / scan_interval_;
  if (!velocity) velocity = image_velocity_;
  if (!velocity) return {SE3(), still_covariance(dt)};
  const Vector6d moved = dt * *velocity;
  const double along = kSurest + kShare * moved.head<3>().norm() + 0.5 * kAcceleration * dt * dt;
  const double about = kSurest + kShare * moved.tail<3>().norm() + 0.5 * kTurning * dt * dt;
  return {SE3::exp(moved), round_covariance(along, about)};
}

// Between scans that tell the motion a body stays as level as from one of them to the next. Planes
// that an image sees before there is a floor to hold them would tilt it else.
Matrix6d FrontEnd::held_to_floor(Matrix6d covariance) const {
  if (!planar_) return covariance;
  const ScanOdometryOptions& options = scan_odometry_.options();
  for (const int k : {2, 3, 4}) {
    const double sigma = k == 2 ? options.sigma_height : options.sigma_level;
    covariance(k, k) = std::min(covariance(k, k), sigma * sigma);
  }
  return covariance;
}

Increment FrontEnd::coasted(Timestamp stamp, Step& step) const {
  step.motion_known = !last_step_;
  step.tracking_lost = last_observed_ && !(stamp - *last_observed_ < kSurelyCoasted);
  Increment on = coast(stamp);
  if (last_scan_ && !step.tracking_lost) on.covariance = held_to_floor(on.covariance);
  return on;
}

// Scans go on: a step between two of them is theirs to tell.
bool FrontEnd::scanned_of_late(Timestamp stamp) const {
  constexpr double kIntervals = 2.5;
  return last_scan_ && stamp - *last_scan_ <= kIntervals * scan_interval_;
}

// Neither wheels nor a scan of late: the first image is one to compare others with.
Increment FrontEnd::bridge(const DepthFrame& frame, Step& step, Diagnostics& metrics) {
  if (scanned_of_late(frame.stamp)) return coasted(frame.stamp, step);
  const auto timer = metrics.time("odometry");
  DepthFrame mounted = frame;  // as the floor has it: the body stands on that
  mounted.camera.camera.T_body_camera = step.observations.T_body_sensor;
  const ImageMotionResult observed = images_.add(mounted, last_image_);
  if (observed.first || observed.lost) {
    const Increment on = coasted(frame.stamp, step);
    step.tracking_lost = step.tracking_lost || observed.lost;
    return on;
  }
  step.motion_known = step.by_image = true;
  step.open_direction = observed.open_direction;
  return {T_start_body_.inverse() * T_start_image_ * observed.increment.T_from_to,
          observed.increment.covariance};
}

// Wheels slip, and an image shows it.
Increment FrontEnd::beside_wheels(const DepthFrame& frame, Step& step, const Increment& wheels,
                                  Diagnostics& metrics) {
  const auto timer = metrics.time("odometry");
  DepthFrame mounted = frame;
  mounted.camera.camera.T_body_camera = step.observations.T_body_sensor;
  const Increment expected =
      follow_slopes_ && slopes_of_late(frame.stamp) ? tilting(wheels) : wheels;
  const ImageMotionResult observed =
      images_.add(mounted, last_image_, MotionGuess{expected.T_from_to, expected.covariance});
  step.left_to_wheels = observed.left_to_wheels;
  if (observed.first || !observed.known || observed.doubtful) return wheels;
  step.by_image = true;
  return observed.increment;
}

// How the body came from the last scan to here, where that is known well enough to lay the next
// one.
std::optional<MotionGuess> FrontEnd::bridged_since_scan() const {
  constexpr double kMostMetres = 0.5, kMostTurn = 0.3;  // m, rad; 1-sigma
  if (!last_scan_ || !since_scan_) return std::nullopt;
  if (!(scan_interval_ > 0) && !image_velocity_) return std::nullopt;  // no image told a motion yet
  const Vector6d sigma = since_scan_->diagonal().cwiseSqrt();
  if (!(sigma.head<2>().maxCoeff() < kMostMetres) || !(sigma(5) < kMostTurn)) return std::nullopt;
  return MotionGuess{T_start_scan_body_.inverse() * T_start_body_, *since_scan_};
}

// No wheels: the camera is the robot, at the mounting its calibration gives. The map's z is the
// normal of the first floor seen, the floor is z = 0, x along the first heading.
Increment FrontEnd::move_by_depth(const DepthFrame& frame, const FloorResult& floor, Step& step,
                                  Diagnostics& metrics) {
  const SE3& T_body_camera = frame.camera.camera.T_body_camera;
  step.observations.T_body_sensor = T_body_camera;
  const auto timer = metrics.time("odometry");
  const ImageMotionResult observed = images_.add(frame, last_image_);
  step.motion_known = observed.known;
  step.open_direction = observed.open_direction;
  step.tracking_lost = observed.lost;
  if (last_step_) return observed.increment;
  if (!floor.floor_camera) return {SE3(), still_covariance()};
  levelled_by_image_ = true;
  return {levelled_pose(T_body_camera * *floor.floor_camera), still_covariance()};
}

}  // namespace lamina
